// The module of the browser build in Node: texts in, results out.
import { readFileSync } from 'node:fs';

export async function compiled(path) {
  return WebAssembly.compile(readFileSync(path));
}

export class Instance {
  static async of(module) {
    const made = new Instance();
    const imports = { env: { now: () => performance.now() } };
    made.exports = (await WebAssembly.instantiate(module, imports)).exports;
    return made;
  }

  /** Calls `name` with these texts or bytes, each as pointer and length. */
  call(name, ...texts) {
    const { exports } = this;
    const given = texts.map(text => {
      const bytes = typeof text === 'string' ? new TextEncoder().encode(text) : text;
      const at = exports.alloc(bytes.length);
      new Uint8Array(exports.memory.buffer, at, bytes.length).set(bytes);
      return [at, bytes.length];
    });
    const result = exports[name](...given.flat());
    for (const [at, length] of given) exports.release(at, length);
    return result;
  }

  get bytes() {
    const { memory, result, result_len } = this.exports;
    return new Uint8Array(memory.buffer, result(), result_len()).slice();
  }

  get text() {
    return new TextDecoder().decode(this.bytes);
  }

  get positions() {
    const { memory, positions, positions_len } = this.exports;
    return new Uint8Array(memory.buffer, positions(), 8 * positions_len());
  }
}
