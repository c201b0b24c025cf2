// node bits.mjs MODULE SCENES POSITIONS [NAME..]: takes the steps of every scene whose positions the native
// program has written (tests/browser_bits.rs), and compares all bits. A scene that names a file is first
// refused with the name of the file, then gets it.
import { createHash } from 'node:crypto';
import { existsSync, readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { Instance, compiled } from './module.mjs';

const [modulePath, scenes, folder, ...names] = process.argv.slice(2);
/** CPU time that the steps of a scene may take [s]; the rest is not compared. */
const LONGEST = Number(process.env.LONGEST ?? 20);
/**
 * Scenes with factors of large matrices: faer multiplies dense blocks with the instructions of each
 * processor, with fused multiply-adds in another order or none. They are close, and have other bits.
 */
const OTHER_FACTORS = new Set(
  `chain cloth_on_ball cooks_membrane_2d crossed_bars gripper hertz_2d incompressible_block soft_stack
   tuning_fork twisted_mat`.split(/\s+/),
);
/** How far the first different step of such a scene may be off, relative to the largest coordinate. */
const CLOSE = 1e-6;
const module = await compiled(modulePath);
let failed = 0,
  close = 0,
  compared = 0;

function seconds() {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1e6;
}

/** Opens a scene; hands over files that it lacks. */
function open(instance, text) {
  const given = [];
  while (instance.call('open', text) !== 0) {
    const { message } = JSON.parse(instance.text);
    const named = [...text.matchAll(/"([^"\n]+\.\w+)"/g)].map(([, name]) => name);
    const missing = named.find(name => !given.includes(name) && message.includes(name));
    if (!missing || !existsSync(join(scenes, missing))) throw new Error(`refused: ${message}`);
    given.push(missing);
    instance.call('file', missing, readFileSync(join(scenes, missing)));
  }
  return given;
}

const numbers = bytes =>
  new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength));

/** Throws where two arrays of positions differ; returns false if they are allowed to. */
function equal(found, expected, { name, step, dimension }) {
  if (Buffer.compare(expected, found) === 0) return true;
  const [a, b] = [found, expected].map(numbers);
  const at = a.findIndex((x, i) => !Object.is(x, b[i]));
  const place = `step ${step}, vertex ${Math.floor(at / dimension)}: ${a[at]} for ${b[at]}`;
  const largest = b.reduce((most, x) => Math.max(most, Math.abs(x)), 0),
    off = a.reduce((most, x, i) => Math.max(most, Math.abs(x - b[i])), 0) / largest;
  if (!OTHER_FACTORS.has(name) || !(off < CLOSE)) throw new Error(place);
  console.log(`${name}: other factors: ${place}; off by ${off.toExponential(1)}`);
  return false;
}

function compare(instance, name, text) {
  const native = readFileSync(join(folder, `${name}.f64`));
  const given = open(instance, text);
  instance.exports.run(0);
  const size = instance.positions.length,
    dimension = /^dimension *= *3/m.test(text) ? 3 : 2,
    steps = native.length / size,
    begun = seconds();
  let step = 0;
  while (step < steps && seconds() - begun < LONGEST) {
    if (instance.exports.run(1) !== 0) throw new Error(`step ${step + 1}: ${instance.text}`);
    const expected = native.subarray(step * size, ++step * size);
    if (!equal(instance.positions, expected, { name, step, dimension })) return false;
  }
  const hash = createHash('sha256').update(instance.positions).digest('hex').slice(0, 16),
    time = ((1e6 * (seconds() - begun)) / step).toFixed(1),
    files = given.length ? `, given ${given}` : '';
  console.log(`${name}: ${step} steps, ${hash}, ${time} us a step${files}`);
  const fault = join(folder, `${name}.fault`);
  if (step === steps && existsSync(fault)) {
    if (instance.exports.run(1) === 0) throw new Error(`step ${step + 1} was taken`);
    if (instance.text !== readFileSync(fault, 'utf8')) throw new Error(`another fault: ${instance.text}`);
  }
  return true;
}

const all = readdirSync(folder).filter(file => file.endsWith('.f64')).map(file => file.slice(0, -4));
for (const name of names.length ? names : all.sort()) {
  const instance = await Instance.of(module);
  try {
    if (compare(instance, name, readFileSync(join(scenes, `${name}.toml`), 'utf8'))) compared += 1;
    else close += 1;
  } catch (error) {
    const trap = error instanceof WebAssembly.RuntimeError ? `trap: ${instance.text}: ` : '';
    console.log(`${name}: ${trap}${error.message}`);
    failed += 1;
  }
}
console.log(`${compared} scenes have the same bits, ${close} are close, ${failed} differ`);
process.exit(failed || compared === 0 ? 1 : 0);
