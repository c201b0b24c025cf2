// The engine as pages see it: a worker with the WebAssembly module, scenes that are opened in it, and the
// frame in which the page of a run is shown.
'use strict';

/** Folder of the site, wherever the page is. */
const SITE = new URL('.', document.currentScript.src).href;
/** Commands of pages around the run count from here, so that they never have the number of one of the run. */
const FIRST_COMMAND = 2 ** 31;
const LIVE_ELEMENT = /<script type="application\/json" id="live">[^<]*<\/script>/;

const bytesOfBase64 = text => Uint8Array.from(atob(text), letter => letter.charCodeAt(0));

async function throughStream(bytes, stream) {
  return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());
}
const inflated = bytes => throughStream(bytes, new DecompressionStream('deflate-raw'));
const deflated = bytes => throughStream(bytes, new CompressionStream('deflate-raw'));

/** Messages of the worker that answer an order by its number. */
const ANSWERS = new Set(['opened', 'downloaded', 'positions']);

/** Data of the site by name: scripts that hold them call `pliantData(name, base64)`. */
const loadedData = new Map();
window.pliantData = (name, base64) => loadedData.set(name, base64);

function loadScript(address) {
  return new Promise((done, failed) => {
    const script = document.createElement('script');
    script.src = address;
    script.addEventListener('load', done);
    script.addEventListener('error', () => failed(new Error(`${address} cannot be loaded`)));
    document.head.append(script);
  });
}

/** Bytes that the site has as a script, because a page from a file can load nothing else. */
async function packedData(name) {
  if (!loadedData.has(name)) await loadScript(`${SITE}data/${name}.js`);
  return inflated(bytesOfBase64(loadedData.get(name)));
}

async function moduleBytes() {
  if (location.protocol === 'file:') return packedData('pliant.wasm');
  const answer = await fetch(`${SITE}data/pliant.wasm.deflate`);
  if (!answer.ok) throw new Error(`data/pliant.wasm.deflate: ${answer.status} ${answer.statusText}`);
  return inflated(await answer.arrayBuffer());
}

/** The module, compiled once for all engines of a page. */
const compiledModule = (() => {
  let compiled;
  return () => (compiled ??= moduleBytes().then(bytes => WebAssembly.compile(bytes)));
})();

/** Line and column, from 1, message and remedies of a scene that was refused. */
function readRefusal(text) {
  const { message, line, column, rendered = '' } = JSON.parse(text);
  const remedies = [...rendered.matchAll(/= (help|note): (.*)/g)].map(([, kind, words]) => ({
    kind,
    words,
  }));
  return { message, line: line ?? null, column: column ?? null, rendered, remedies };
}

class Engine {
  /** Handlers: `text(message)`, `frame(buffer)`, `work({ steps, ms })`, `fault(message)`. */
  constructor(on = {}) {
    Object.assign(this, { on, asked: new Map(), number: 0, commands: FIRST_COMMAND });
    const source = new Blob([`(${pliantWorker})()`], { type: 'text/javascript' }),
      address = URL.createObjectURL(source);
    this.worker = new Worker(address);
    this.worker.onmessage = ({ data }) => this.#take(data);
    this.worker.onerror = event => this.#fault(event.message ?? 'the worker could not start');
    addEventListener('message', event => this.#pageIsReady(event));
    document.addEventListener('visibilitychange', () => this.#tell({ do: 'sleep', on: document.hidden }));
    this.loaded = new Promise((done, failed) => Object.assign(this, { done, failed }));
    this.loaded.catch(() => {});
    compiledModule()
      .then(module => this.#tell({ do: 'load', module }))
      .catch(fault => this.#fault(String(fault)));
  }

  #tell(order, transfer = []) {
    this.worker.postMessage(order, transfer);
  }

  #fault(message) {
    this.failed(new Error(message));
    for (const settle of this.asked.values()) settle({ status: 2, ok: false, text: message, message });
    this.asked.clear();
    this.on.fault?.(message);
  }

  #settle(number, answer) {
    this.asked.get(number)?.(answer);
    this.asked.delete(number);
  }

  #take({ event, ...data }) {
    if (event === 'loaded') this.done();
    else if (event === 'fault') this.#fault(data.message);
    else if (ANSWERS.has(event)) this.#settle(data.number, data);
    else if (event === 'work') this.on.work?.(data);
    else if (event === 'frame') this.on.frame?.(data.bytes);
    else if (event === 'text') this.#text(JSON.parse(data.text));
  }

  #text(message) {
    if (message.type === 'reply') this.#settle(message.command, message);
    this.on.text?.(message);
  }

  #answer(number) {
    return new Promise(settle => this.asked.set(number, settle));
  }

  file(name, bytes) {
    this.#tell({ do: 'file', name, bytes });
  }

  forgetFiles() {
    this.#tell({ do: 'forget' });
  }

  /** Opens a scene: `{ html }`, or what was wrong with it: `{ refusal }`, or `{ fault }`. */
  async open(text, before = []) {
    await this.loaded;
    // Nobody answers commands to the scene before.
    for (const asked of this.asked.keys()) if (asked >= FIRST_COMMAND) this.#settle(asked, { ok: true });
    const number = ++this.number;
    const commands = before.map(command => ({ command: this.commands++, ...command }));
    const answer = this.#answer(number);
    this.#tell({ do: 'open', number, text, before: commands });
    const { status, text: said } = await answer;
    if (status === 0) return { html: said };
    return status === 1 ? { refusal: readRefusal(said) } : { fault: said };
  }

  /** Shows the page of the open scene in a frame. */
  show(frame, html, { style = '', theme = null } = {}) {
    this.frame = frame;
    const live = '<script type="application/json" id="live">{"port":true}</script>';
    let page = html.replace(LIVE_ELEMENT, live);
    if (theme) page = page.replace('<html ', `<html data-theme="${theme}" `);
    frame.srcdoc = page.replace('</head>', `<style>${style}</style></head>`);
  }

  /** Sends the open scene to the page that is shown: its mesh is the same. */
  greetAgain() {
    this.#tell({ do: 'page' });
  }

  #pageIsReady({ source, data }) {
    if (!this.frame || source !== this.frame.contentWindow || data?.pliant !== 'ready') return;
    const { port1, port2 } = new MessageChannel();
    this.#tell({ do: 'page', port: port1 }, [port1]);
    source.postMessage({ pliant: 'port' }, '*', [port2]);
  }

  /** The run's reply to a command: `{ ok, message }`. */
  ask(command) {
    const number = this.commands++,
      answer = this.#answer(number);
    this.tell({ command: number, ...command });
    return answer;
  }

  /** Sends a command; the reply, if any, is not awaited. */
  tell(command) {
    this.#tell({ do: 'command', text: JSON.stringify({ command: this.commands++, ...command }) });
  }

  /** Recording of the run so far: `{ bytes }`, or `{ message }`. */
  async download() {
    const number = ++this.number,
      answer = this.#answer(number);
    this.#tell({ do: 'download', number });
    const { status, bytes, text } = await answer;
    if (status === 0) return { bytes };
    return { message: text ?? new TextDecoder().decode(bytes) };
  }

  /** Steps that give so many bytes of positions: `{ steps, sha256 }`, or `{ text }` that says why not. */
  async positions(text, length) {
    await this.loaded;
    const number = ++this.number,
      answer = this.#answer(number);
    this.#tell({ do: 'positions', number, text, length });
    return answer;
  }

  end() {
    this.worker.terminate();
  }
}
