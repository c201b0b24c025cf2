// node fuzz.mjs MODULE SCENES [COUNT [SEED]]: opens scenes with mistakes, COUNT of them, and takes a few
// steps of those that open. A trap is a fault; a message is none.
import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { Worker, isMainThread, parentPort, workerData } from 'node:worker_threads';
import { Instance } from './module.mjs';

/** Time for one scene [ms]. */
const LONGEST = 20000;
/** Steps of a scene that opens. */
const STEPS = 3;
/** Time that a scene may take as it is, for texts with mistakes to be made of it [ms]. */
const QUICK = 500;
/** Scenes that one instance opens. */
const SCENES_OF_AN_INSTANCE = 50;

/** Mulberry32. */
function generator(seed) {
  return count => {
    seed = (seed + 0x6d2b79f5) | 0;
    let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) % count;
  };
}

const VALUES = ['0', '-1', '1e308', '-1e-308', 'nan', 'inf', '1e-9', '4294967296', '2.5', 'true', '"x"', '[]',
  '[1, 2]', '{}', '"1 m"', '"-3 MPa"', '""', '"a / 0"', '100', '"\\u0000"'];

/** The text with one to four mistakes. */
function mutated(texts, below) {
  let text = texts[below(texts.length)];
  for (let count = 1 + below(4); count > 0; count -= 1) {
    const lines = text.split('\n'),
      line = below(lines.length),
      at = below(text.length + 1);
    const value = VALUES[below(VALUES.length)];
    const kind = below(8);
    if (kind === 0) lines.splice(line, 1);
    else if (kind === 1) lines.splice(line, 0, lines[below(lines.length)]);
    else if (kind === 2) {
      const other = texts[below(texts.length)].split('\n');
      lines.splice(line, 0, other[below(other.length)]);
    } else if (kind === 3) lines[line] = lines[line].replace(/=.*/, `= ${value}`);
    else if (kind === 4 || kind === 5) {
      const numbers = [...text.matchAll(/-?\d+(\.\d+)?(e-?\d+)?/g)];
      if (!numbers.length) continue;
      const number = numbers[below(numbers.length)];
      text = text.slice(0, number.index) + value + text.slice(number.index + number[0].length);
      continue;
    } else if (kind === 6) {
      text = text.slice(0, at) + String.fromCharCode(32 + below(95)) + text.slice(at);
      continue;
    } else {
      text = text.slice(0, at) + text.slice(at + 1 + below(20));
      continue;
    }
    text = lines.join('\n');
  }
  return text;
}

async function work() {
  const { module, files } = workerData;
  let instance;
  let opened = 0;
  parentPort.on('message', async text => {
    try {
      if (!instance || ++opened > SCENES_OF_AN_INSTANCE) {
        instance = await Instance.of(module);
        for (const [name, bytes] of files) instance.call('file', name, bytes);
        opened = 1;
      }
      const status = instance.call('open', text);
      if (status === 0) {
        instance.exports.run(STEPS);
        instance.exports.greet();
        instance.exports.advance();
        while (instance.exports.message() !== 0);
      } else {
        const { message, rendered } = JSON.parse(instance.text);
        if (!message || !rendered) throw new Error('a refusal without a message');
      }
      parentPort.postMessage({ status });
    } catch (error) {
      parentPort.postMessage({ fault: `${error.message}: ${instance?.text}` });
      instance = undefined;
    }
  });
}

/** True if the scene opens and takes its steps in a short time. */
async function isQuick(module, files, text) {
  const instance = await Instance.of(module);
  for (const [name, bytes] of files) instance.call('file', name, bytes);
  const before = process.cpuUsage();
  if (instance.call('open', text) !== 0) throw new Error(`a scene is refused: ${instance.text}`);
  instance.exports.run(STEPS);
  const { user, system } = process.cpuUsage(before);
  return user + system < 1000 * QUICK;
}

async function main() {
  const [path, scenes, count = '10000', seed = '1'] = process.argv.slice(2);
  const module = await WebAssembly.compile(readFileSync(path));
  const all = readdirSync(scenes)
    .filter(file => file.endsWith('.toml'))
    .sort()
    .map(file => readFileSync(join(scenes, file), 'utf8'));
  const meshes = readdirSync(join(scenes, 'meshes'));
  const files = meshes.map(name => [`meshes/${name}`, readFileSync(join(scenes, 'meshes', name))]);
  const below = generator(Number(seed));
  const texts = [];
  for (const text of all) if (await isQuick(module, files, text)) texts.push(text);
  const counts = { opened: 0, refused: 0, slow: 0, faults: 0 };
  const start = () => new Worker(new URL(import.meta.url), { workerData: { module, files } });
  let worker = start();
  for (let i = 0; i < Number(count); i += 1) {
    const text = mutated(texts, below);
    const answer = await new Promise(settle => {
      const timer = setTimeout(() => settle({ slow: true }), LONGEST);
      worker.once('message', message => {
        clearTimeout(timer);
        settle(message);
      });
      worker.postMessage(text);
    });
    if (answer.slow) {
      counts.slow += 1;
      console.log(`scene ${i} takes longer than ${LONGEST} ms`);
      await worker.terminate();
      worker = start();
    } else if (answer.fault) {
      counts.faults += 1;
      console.log(`scene ${i}: ${answer.fault}\n${counts.faults < 4 ? text : ''}`);
    } else if (answer.status === 0) counts.opened += 1;
    else counts.refused += 1;
  }
  await worker.terminate();
  const { opened, refused, slow, faults } = counts;
  console.log(`${opened} opened, ${refused} refused, ${slow} too slow to wait for, ${faults} faults`);
  process.exit(faults || opened === 0 || refused === 0 ? 1 : 0);
}

if (isMainThread) await main();
else await work();
