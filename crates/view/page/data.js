// The packed recording: its head, lists of numbers, and numbers over time.

/** Code of a number that is not finite. */
export const MISSING = 65535;

async function inflate(name) {
  const block = document.querySelector(`script[data-data="${name}"]`);
  const bytes = Uint8Array.from(atob(block.textContent), letter => letter.charCodeAt(0));
  block.remove();
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Description of the recording. */
export async function readHead() {
  return JSON.parse(new TextDecoder().decode(await inflate('head')));
}

/** Whole numbers of 32 bits. */
export async function readList(name) {
  return new Uint32Array((await inflate(name)).buffer);
}

/** Undoes byte planes, zigzag and differences of `order` in time; frames of `length` codes each. */
export function decode(bytes, length, order) {
  const count = bytes.length / 2,
    codes = new Uint16Array(count);
  for (let k = 0; k < count; k++) {
    const zigzag = bytes[k] | (bytes[count + k] << 8);
    let code = (zigzag >>> 1) ^ -(zigzag & 1);
    if (k >= 2 * length && order === 2) code += 2 * codes[k - length] - codes[k - 2 * length];
    else if (k >= length) code += codes[k - length];
    codes[k] = code;
  }
  return codes;
}

/** Codes of all frames, chunk after chunk; `blockOf(chunk)` is the name of a block. */
export class Series {
  constructor(length, orders, blockOf) {
    Object.assign(this, { length, orders, blockOf, chunks: [] });
  }

  get chunkCount() {
    return this.orders.length;
  }

  async read(chunk) {
    this.chunks[chunk] ??= decode(await inflate(this.blockOf(chunk)), this.length, this.orders[chunk]);
  }

  /** Codes of a frame; undefined until its chunk is read. */
  frame(frame, chunkSize) {
    const codes = this.chunks[Math.floor(frame / chunkSize)];
    const first = (frame % chunkSize) * this.length;
    return codes?.subarray(first, first + this.length);
  }
}
