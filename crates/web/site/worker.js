// The worker that owns the WebAssembly module: it takes orders of the page around it and relays messages
// between the module and the page of a run. The page makes the worker from the text of this function, because
// a page from a file cannot load a worker by its address.
'use strict';

/** Runs in the worker. Nothing outside of this function exists there. */
function pliantWorker() {
  const KINDS = { none: 0, text: 1, frame: 2 };
  /** Interval between reports of the work done [ms]. */
  const REPORT = 500;

  class WasmModule {
    constructor(compiled) {
      const instance = new WebAssembly.Instance(compiled, { env: { now: () => performance.now() } });
      this.wasm = instance.exports;
      this.wasm._initialize?.();
    }

    /** Calls an export with bytes, each as a pointer and a length. */
    call(name, ...blocks) {
      const given = blocks.map(bytes => {
        const at = this.wasm.alloc(bytes.length) >>> 0;
        // Memory may have grown, which detaches views of it.
        new Uint8Array(this.wasm.memory.buffer, at, bytes.length).set(bytes);
        return [at, bytes.length];
      });
      const status = this.wasm[name](...given.flat());
      given.forEach(([at, length]) => this.wasm.release(at, length));
      return status;
    }

    /** Copy of the result of the last call. */
    result() {
      const at = this.wasm.result() >>> 0;
      return new Uint8Array(this.wasm.memory.buffer, at, this.wasm.result_len() >>> 0).slice();
    }

    text() {
      return new TextDecoder().decode(this.result());
    }
  }

  const bytesOf = text => new TextEncoder().encode(text);
  const files = new Map();
  /** Makes calls to `advance` that let messages in between. */
  const { port1: turn, port2: next } = new MessageChannel();
  let compiled, module, page, timer;
  let firsts = [];
  /** A scene runs once a page has connected. */
  let isOpen = false,
    running = false,
    asleep = false,
    turning = false;
  let work = { since: 0, ms: 0, from: 0, step: 0, isFirst: true };

  const tell = (event, more = {}, transfer = []) => postMessage({ event, ...more }, transfer);

  /** A trap ends the module; the next scene gets a new one. */
  function fail(fault) {
    let told = '';
    try {
      told = module?.text() ?? '';
    } catch {
      // The module cannot even say what happened.
    }
    const message = told.length > 0 && told.length < 4000 ? told : String(fault);
    [module, isOpen, running] = [undefined, false, false];
    tell('fault', { message });
  }

  function ready() {
    if (module) return;
    module = new WasmModule(compiled);
    for (const [name, bytes] of files) module.call('file', bytesOf(name), bytes);
  }

  /** Takes all waiting messages of the run. */
  function relay() {
    for (let kind; (kind = module.wasm.message()) !== KINDS.none;) {
      const bytes = module.result();
      if (kind === KINDS.text) {
        const text = new TextDecoder().decode(bytes);
        page?.postMessage(text);
        tell('text', { text });
        continue;
      }
      work.step = Number(new DataView(bytes.buffer).getBigUint64(8, true));
      tell('frame', { bytes: bytes.buffer });
      page?.postMessage(bytes.buffer, [bytes.buffer]);
    }
  }

  function report(now) {
    if (now - work.since < REPORT) return;
    const steps = work.step - work.from;
    // In the first interval the browser is still compiling.
    if (steps > 0 && !work.isFirst) tell('work', { steps, ms: work.ms });
    work = { since: now, ms: 0, from: work.step, step: work.step, isFirst: work.isFirst && steps <= 0 };
  }

  function advance() {
    clearTimeout(timer);
    if (!running || asleep) return;
    try {
      const begin = performance.now(),
        wait = module.wasm.advance();
      relay();
      const now = performance.now();
      work.ms += now - begin;
      report(now);
      if (wait > 0) timer = setTimeout(advance, wait);
      else soon();
    } catch (fault) {
      fail(fault);
    }
  }

  function soon() {
    if (turning) return;
    turning = true;
    next.postMessage(0);
  }
  turn.onmessage = () => {
    turning = false;
    advance();
  };

  function command(text) {
    if (!running) {
      const refused = {
        type: 'reply',
        command: JSON.parse(text).command,
        ok: false,
        message: 'no scene runs',
      };
      tell('text', { text: JSON.stringify(refused) });
      return;
    }
    module.call('command', bytesOf(text));
    soon();
  }

  /** Positions after each step of a scene without a page. */
  function positionsOf(text, length) {
    const alone = new WasmModule(compiled);
    for (const [name, bytes] of files) alone.call('file', bytesOf(name), bytes);
    if (alone.call('open', bytesOf(text)) !== 0) throw new Error(alone.text());
    const taken = new Uint8Array(length);
    let [at, steps] = [0, 0];
    for (; at < length; steps++) {
      if (alone.wasm.run(1) !== 0) throw new Error(alone.text());
      const size = 8 * alone.wasm.positions_len();
      taken.set(new Uint8Array(alone.wasm.memory.buffer, alone.wasm.positions() >>> 0, size), at);
      at += size;
    }
    return { taken, steps };
  }

  const guarded = act => data => {
    try {
      return act(data);
    } catch (fault) {
      return fail(fault);
    }
  };

  const orders = {
    load(given) {
      compiled = given.module;
      ready();
      tell('loaded');
    },
    file({ name, bytes }) {
      files.set(name, bytes);
      module?.call('file', bytesOf(name), bytes);
    },
    forget() {
      files.clear();
      module?.wasm.forget_files();
    },
    /** Opens a scene; these commands are given before its first step, once a page has connected. */
    open({ number, text, before }) {
      isOpen = running = false;
      firsts = before;
      ready();
      const status = module.call('open', bytesOf(text)),
        answer = module.text();
      isOpen = status === 0;
      work = { since: performance.now(), ms: 0, from: 0, step: 0, isFirst: true };
      tell('opened', { number, status, text: answer });
    },
    /** A page of the run has connected; without a port, the one before reads the new scene. */
    page({ port }) {
      if (port) {
        page?.close();
        page = port;
        page.onmessage = guarded(({ data }) => command(data));
      }
      if (!isOpen) return;
      running = true;
      module.wasm.greet();
      for (const first of firsts) module.call('command', bytesOf(JSON.stringify(first)));
      firsts = [];
      relay();
      soon();
    },
    command: ({ text }) => command(text),
    sleep({ on }) {
      asleep = on;
      if (!on) soon();
    },
    /** Hash of the positions after each of so many steps that they are `length` bytes. */
    async positions({ number, text, length }) {
      try {
        const { taken, steps } = positionsOf(text, length),
          hash = new Uint8Array(await crypto.subtle.digest('SHA-256', taken));
        const sha256 = Array.from(hash, byte => byte.toString(16).padStart(2, '0')).join('');
        tell('positions', { number, steps, sha256 });
      } catch (fault) {
        tell('positions', { number, text: String(fault) });
      }
    },
    download({ number }) {
      const status = isOpen ? module.call('download') : 1,
        bytes = isOpen ? module.result() : bytesOf('no scene is open');
      tell('downloaded', { number, status, bytes: bytes.buffer }, [bytes.buffer]);
    },
  };
  onmessage = guarded(({ data }) => orders[data.do](data));
}
