// Makes the folder of static files of the browser build: node make.mjs MODULE DIR [PLIANT [BITS]].
// MODULE is the WebAssembly module, DIR the folder to write, PLIANT a native program whose time a step is
// shown next to that of the browser. BITS is a folder with the positions after each step, `NAME.f64` for each
// scene, as the native program has written them: the pages compare them.
import { execFileSync } from 'node:child_process';
import { cpSync, existsSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { availableParallelism, cpus } from 'node:os';
import { basename, dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { createHash } from 'node:crypto';
import { deflateRawSync } from 'node:zlib';

const [, , modulePath, folder, program, bits] = process.argv;
if (!folder) throw new Error('usage: node make.mjs MODULE DIR [PLIANT [BITS]]');
const site = dirname(fileURLToPath(import.meta.url)),
  scenes = join(site, '../../../scenes'),
  data = join(folder, 'data');
const STEPS = 9;
/** Steps of each scene that the native program takes for its time a step, and its longest time [ms]. */
const MEASURED_STEPS = 50;
const LONGEST = 20000;

/** Files of a scene: paths in quotes that lead to a folder beside it. */
const filesOf = text => [...new Set([...text.matchAll(/"(meshes\/[^"]+)"/g)].map(([, path]) => path))];

function readScenes() {
  const names = readdirSync(scenes).filter(name => name.endsWith('.toml'));
  return names.sort().map(file => {
    const text = readFileSync(join(scenes, file), 'utf8'),
      [, title = basename(file, '.toml')] = /^title = "(.*)"$/m.exec(text) ?? [];
    // The schema is for editors of files.
    return {
      name: basename(file, '.toml'),
      title,
      text: text.replace(/^#:schema .*\n/, ''),
      files: filesOf(text),
    };
  });
}

/** A script that hands over bytes, for pages from a file, which can load nothing else. */
function writeData(name, bytes) {
  const base64 = deflateRawSync(bytes, { level: 9 }).toString('base64');
  const path = join(data, `${name}.js`);
  mkdirSync(dirname(path), { recursive: true });
  writeFileSync(path, `pliantData(${JSON.stringify(name)}, '${base64}');\n`);
}

/** Time a step of the native program on this machine [ms]; undefined where it cannot take these steps. */
function nativeTime(scene) {
  const step = /^step = ("?)([0-9.e-]+)( ?(ms|us|s))?\1/m.exec(scene.text);
  if (!step) return undefined;
  const seconds = Number(step[2]) * { undefined: 1, s: 1, ms: 1e-3, us: 1e-6 }[step[4]];
  const until = ['--until', String(MEASURED_STEPS * seconds), '--no-record', '--json'];
  try {
    const told = execFileSync(program, ['run', join(scenes, `${scene.name}.toml`), ...until], {
      stdio: ['ignore', 'pipe', 'ignore'],
      timeout: LONGEST,
    });
    const { steps, wall_seconds: wall } = JSON.parse(told).summary;
    return steps > 0 && wall > 0 ? (1000 * wall) / steps : undefined;
  } catch {
    return undefined;
  }
}

/** Length and SHA-256 of the positions that the native program has written; undefined without them. */
function nativeBits(scene) {
  const path = bits && join(bits, `${scene.name}.f64`);
  if (!path || !existsSync(path)) return undefined;
  const positions = readFileSync(path);
  return { length: positions.length, sha256: createHash('sha256').update(positions).digest('hex') };
}

// Only a folder that this script wrote is written over.
const old = existsSync(folder) ? readdirSync(folder) : [];
if (old.length && !existsSync(join(data, 'scenes.js'))) throw new Error(`${folder} has other files in it`);
for (const name of old) rmSync(join(folder, name), { recursive: true });
mkdirSync(join(folder, 'lecture'), { recursive: true });
mkdirSync(data);
for (const name of readdirSync(site).filter(name => /\.(html|js|css)$/.test(name))) {
  cpSync(join(site, name), join(folder, name));
}
for (const name of readdirSync(join(site, 'lecture')).filter(name => /\.(js|css)$/.test(name))) {
  cpSync(join(site, 'lecture', name), join(folder, 'lecture', name));
}
const template = readFileSync(join(site, 'lecture/page.html'), 'utf8');
for (let step = 0; step <= STEPS; step++) {
  const page = template.replaceAll('STEP', String(step));
  writeFileSync(join(folder, 'lecture', step === 0 ? 'index.html' : `${step}.html`), page);
}

const shipped = readScenes();
writeFileSync(join(data, 'scenes.js'), `window.pliantScenes = ${JSON.stringify(shipped)};\n`);
for (const path of new Set(shipped.flatMap(scene => scene.files))) {
  writeData(path, readFileSync(join(scenes, path)));
}
const module = readFileSync(modulePath);
writeData('pliant.wasm', module);
const packed = deflateRawSync(module, { level: 9 });
writeFileSync(join(data, 'pliant.wasm.deflate'), packed);

const native = program
  ? {
      machine: cpus()[0].model,
      threads: availableParallelism(),
      times: Object.fromEntries(shipped.map(scene => [scene.name, nativeTime(scene)])),
    }
  : null;
const written = Object.fromEntries(shipped.map(scene => [scene.name, nativeBits(scene)]));
writeFileSync(
  join(data, 'native.js'),
  `window.pliantNative = ${JSON.stringify(native)};\nwindow.pliantBits = ${JSON.stringify(written)};\n`,
);
console.log(
  `${folder}: ${shipped.length} scenes, module ${module.length} bytes, packed ${packed.length} bytes`,
);
