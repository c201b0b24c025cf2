// node session.mjs MODULE SCENE FILE: what a page does: it connects, lets the scene run, steps, changes a
// parameter, goes to the start; FILE is the recording of the run so far.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { Instance, compiled } from './module.mjs';

const [modulePath, scene, file] = process.argv.slice(2);
const instance = await Instance.of(await compiled(modulePath));
const { exports } = instance;

/** Messages that are waiting. */
function messages() {
  const texts = [];
  let frames = 0;
  for (let kind; (kind = exports.message()) !== 0; ) {
    if (kind === 1) texts.push(JSON.parse(instance.text));
    else {
      assert.equal(new DataView(instance.bytes.buffer).getUint32(0, true), 0x4d525450);
      frames += 1;
    }
  }
  return { texts, frames };
}

let command = 0;
/** The reply to a command. */
function asked(action) {
  instance.call('command', JSON.stringify({ command: ++command, ...action }));
  exports.advance();
  const reply = messages().texts.find(text => text.type === 'reply' && text.command === command);
  assert.ok(reply, JSON.stringify(action));
  return reply;
}

assert.equal(exports.advance(), Infinity);
assert.equal(exports.download(), 1);
assert.equal(instance.call('open', 'dimension = 4'), 1);
assert.equal(typeof JSON.parse(instance.text).message, 'string');
assert.equal(instance.call('open', readFileSync(scene)), 0);
const page = instance.text;
assert.match(page, /id="live">{"port":true}</);

exports.greet();
const hello = messages().texts[0];
assert.equal(hello.type, 'hello');
const control = hello.controls.find(({ kind }) => kind === 'number');
assert.equal(asked({ do: 'set', path: control.path, value: control.value }).ok, true);
assert.equal(asked({ do: 'set', path: 'no.such.key', value: 1 }).ok, false);
assert.equal(asked({ do: 'pause' }).ok, true);
assert.ok(exports.advance() > 0);
const begun = performance.now();
let frames = 0;
instance.call('command', JSON.stringify({ command: ++command, do: 'continue' }));
while (performance.now() - begun < 300) {
  const wait = exports.advance();
  frames += messages().frames;
  if (wait > 0) await new Promise(settle => setTimeout(settle, wait));
}
assert.ok(frames > 1, 'frames come');
assert.equal(asked({ do: 'pause' }).ok, true);
assert.equal(exports.download(), 0, instance.text);
writeFileSync(file, instance.bytes);
assert.equal(asked({ do: 'reset' }).ok, true);
assert.equal(exports.download(), 0, instance.text);
const time = Math.round(performance.now() - begun);
console.log(`the page of ${page.length} bytes, ${frames} frames in ${time} ms`);
