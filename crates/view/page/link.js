// The link to a run: commands go out, and replies, states and frames come in. A carrier takes them over the
// socket of `pliant live`, or over a port to a worker in the page around this one.

const MAGIC = 0x4d525450;
const HEADER = 40;
/** Waits before each try to connect again [ms]. */
const WAITS = [500, 1000, 2000, 4000, 8000];

/** A frame: positions, speeds and values of elements, in the order of the run. */
export function readFrame(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < HEADER || view.getUint32(0, true) !== MAGIC)
    throw new Error('the run sent a frame that is none');
  const [vertexCount, dimension, elementCount] = [24, 28, 32].map(at => view.getUint32(at, true));
  const speeds = HEADER + 4 * vertexCount * dimension,
    values = speeds + 4 * vertexCount;
  return {
    command: view.getUint32(4, true),
    step: Number(view.getBigUint64(8, true)),
    time: view.getFloat64(16, true),
    dimension,
    positions: new Float32Array(buffer, HEADER, vertexCount * dimension),
    speeds: new Float32Array(buffer, speeds, vertexCount),
    values: new Float32Array(buffer, values, elementCount),
  };
}

/** Carries messages over a socket, and opens it again when it is lost. */
class SocketCarrier {
  constructor(path, on) {
    const { protocol, host } = location;
    const address = `${protocol === 'https:' ? 'wss' : 'ws'}://${host}${path}`;
    Object.assign(this, { address, on, tries: 0 });
    this.#open();
  }

  get isOpen() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  #open() {
    const socket = new WebSocket(this.address);
    let opened = false;
    this.socket = socket;
    socket.binaryType = 'arraybuffer';
    socket.addEventListener('open', () => {
      opened = true;
      this.tries = 0;
    });
    socket.addEventListener('message', event => this.on.read(event.data));
    socket.addEventListener('close', () => this.#lost(opened));
  }

  #lost(opened) {
    const wait = WAITS[this.tries++];
    if (wait !== undefined) this.retry = setTimeout(() => this.#open(), wait);
    this.on.lost(opened, wait !== undefined);
  }

  /** Tries now, and a few times more. */
  connect() {
    clearTimeout(this.retry);
    this.tries = 0;
    if (this.socket.readyState === WebSocket.CLOSED) this.#open();
  }

  send(text) {
    this.socket.send(text);
  }
}

/** Carries messages over a `MessagePort` that the page around this one gives when it is asked. */
class PortCarrier {
  constructor(on) {
    this.on = on;
    addEventListener('message', ({ source, data, ports }) => {
      if (source === parent && data?.pliant === 'port' && ports.length) this.#take(ports[0]);
    });
    this.connect();
  }

  get isOpen() {
    return this.port !== undefined;
  }

  /** A new port replaces the one before: the worker was started again. */
  #take(port) {
    if (this.port) {
      this.port.close();
      this.on.lost(true, true);
    }
    this.port = port;
    port.onmessage = ({ data }) => this.on.read(data);
  }

  connect() {
    // A page from a file has no origin that could be named.
    parent.postMessage({ pliant: 'ready' }, '*');
  }

  send(text) {
    this.port.postMessage(text);
  }
}

/**
 * Calls `take[type](message)` for what comes, `take.frame(frame)` for frames, `take.refused(reply)` for
 * refused commands whose reply is not awaited, and `take.lost(opened, again)`. The page names its `socket`,
 * or has none and asks for a port.
 */
export class Link {
  constructor({ socket }, take) {
    Object.assign(this, { take, command: 0, waiting: new Map() });
    const on = { read: data => this.#read(data), lost: (...how) => this.#lost(...how) };
    this.carrier = socket ? new SocketCarrier(socket, on) : new PortCarrier(on);
  }

  get isOpen() {
    return this.carrier.isOpen;
  }

  #read(data) {
    if (data instanceof ArrayBuffer) {
      this.take.frame(readFrame(data));
      return;
    }
    const message = JSON.parse(data);
    if (message.type === 'reply') this.#settle(message);
    else this.take[message.type]?.(message);
  }

  #settle(reply) {
    const settle = this.waiting.get(reply.command);
    this.waiting.delete(reply.command);
    if (settle) settle(reply);
    else if (!reply.ok) this.take.refused(reply);
  }

  #lost(opened, again) {
    for (const settle of this.waiting.values()) settle({ ok: false, message: 'the run does not answer' });
    this.waiting.clear();
    this.take.lost(opened, again);
  }

  /** Tries to connect again. */
  connect() {
    this.carrier.connect();
  }

  /** Number of a command that is sent without waiting for its reply; 0 if there is no connection. */
  send(command) {
    if (!this.isOpen) return 0;
    this.carrier.send(JSON.stringify({ command: ++this.command, ...command }));
    return this.command;
  }

  /** The run's reply: `{ ok, message }`. */
  ask(command) {
    return new Promise(settle => {
      const number = this.send(command);
      if (number) this.waiting.set(number, settle);
      else settle({ ok: false, message: 'the run does not answer' });
    });
  }
}
