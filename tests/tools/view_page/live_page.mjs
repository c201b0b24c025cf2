// The page of `pliant live` in a headless Chromium: node live_page.mjs PLIANT FOLDER. Waits for what the page
// publishes, never for a time.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { existsSync, rmSync, writeFileSync } from 'node:fs';
import { launch, watched } from './browser.mjs';

const [, , pliant, folder] = process.argv;
const BODY = 'beam';
const PIN = `pin.${BODY}/clamp`;

/** The program on a scene, and the address that it prints. */
async function serve(scene) {
  const program = spawn(pliant, ['live', scene, '--no-open'], { cwd: folder });
  program.said = '';
  program.stderr.on('data', text => (program.said += text));
  program.address = await new Promise((found, failed) => {
    let printed = '';
    program.stdout.on('data', text => {
      printed += text;
      const address = /http:\/\/\S+/.exec(printed);
      if (address) found(address[0]);
    });
    program.on('exit', code => failed(new Error(`it ended with ${code}: ${program.said}`)));
  });
  return program;
}

/** The page with the helpers that checks need. */
async function open(browser, address) {
  const page = await watched(browser, address, { width: 800, height: 600 });
  // Asked from here: timers of a page that draws without a pause may wait long. Not without a pause: questions go
  // before pictures.
  page.until = async (test, ...given) => {
    for (const end = Date.now() + 60000; !(await page.evaluate(test, ...given)); ) {
      const state = JSON.stringify(await page.evaluate(() => pliant.view.state));
      if (Date.now() > end) throw new Error(`${test}: ${state}; ${page.faults.join('; ')}`);
      await new Promise(go => setTimeout(go, 30));
    }
  };
  await page.until(() => pliant.view.shown && pliant.drawn === 0);
  return page;
}

/** Clicks, but not by the mouse, which waits for a page that draws without a pause. */
const press = (page, selector) => page.$eval(selector, found => found.click());
const state = page => page.evaluate(() => pliant.view.state);
/** Step of the frame that is shown. */
const step = page => page.evaluate(() => pliant.view.shown.step);
/** Number in the body of the vertex at the free end, and its place. */
const tip = page =>
  page.evaluate(() => {
    const body = pliant.view.bodies[0];
    window.tip ??= [...Array(body.count).keys()].reduce((best, v) =>
      body.place(v, 0)[0] > body.place(best, 0)[0] + 1e-3 ? v : best,
    );
    return body.place(window.tip, 0);
  });

/**
 * Runs as fast as it goes until the beam has come to rest, and stops there. What it is damped by, 5 a second, takes
 * its swing down to exp(-2.5 t): 4 s, so many steps, leave 5e-5 of it. A small kinetic energy alone would also be
 * found where a swing turns.
 */
const STEPS_TO_REST = 400;
async function settle(page) {
  await page.select('#speed', '7');
  const { step: from, paused } = await state(page);
  if (paused) await press(page, '#play');
  await page.until(first => pliant.view.state.step > first, from + STEPS_TO_REST);
  await press(page, '#play');
  // The picture is that of the last step.
  await page.until(() => pliant.view.state.paused && pliant.view.shown.step === pliant.view.state.step);
  const { kinetic } = (await state(page)).energy;
  assert.ok(kinetic < 1e-5, `a kinetic energy of ${kinetic} J is left`);
  await page.select('#speed', '3');
}

/** Puts a number into the field of a control. */
const type = (page, path, value) =>
  page.$eval(
    `[data-path="${path}"] input[type=number]`,
    (field, wanted) => {
      field.value = wanted;
      field.dispatchEvent(new Event('change'));
    },
    value,
  );
const control = (page, path) =>
  page.evaluate(wanted => pliant.view.controls.rows.get(wanted).control.value, path);

async function namesAreText(page) {
  const { title, broken, children } = await page.evaluate(() => ({
    title: document.title,
    broken: window.broken,
    children: document.querySelector('#panel summary').children.length,
  }));
  assert.ok(title.startsWith('</script><script>window.broken'), title);
  assert.equal(broken, undefined, 'markup in the title ran');
  assert.equal(children, 0);
  const groups = await page.$$eval('#panel summary', found => found.map(group => group.textContent));
  assert.deepEqual(groups, [BODY, 'world', 'pins', 'time', 'recording']);
}

async function pauseStepAndResetDoWhatTheySay(page) {
  const [, , start] = await tip(page);
  await page.until(() => pliant.view.shown.step > 5);
  await page.keyboard.press(' ');
  await page.until(() => pliant.view.state.paused && !pliant.view.playing);
  const { step: paused } = await state(page);
  for (const further of [1, 2, 3]) {
    await page.keyboard.press('.');
    await page.until(wanted => pliant.view.shown.step === wanted, paused + further);
  }
  assert.ok((await state(page)).paused);
  await page.keyboard.press('r');
  await page.until(() => pliant.view.state.step === 0 && pliant.view.shown.step === 0);
  const [, , again] = await tip(page);
  page.start = again;
  assert.ok(again - start > -1e-4, `after a reset the tip is at ${again}, not at or above ${start}`);
  await press(page, '#play');
  await page.until(() => pliant.view.playing && pliant.view.shown.step > 3);
}

async function aStifferBeamSagsLess(page) {
  const path = 'body.0.elastic.neo-hookean.young';
  await settle(page);
  const sag = async () => page.start - (await tip(page))[2],
    soft = await sag();
  await type(page, path, 2e6);
  await page.until(wanted => pliant.view.controls.rows.get(wanted).control.value === 2e6, path);
  await settle(page);
  const stiff = await sag();
  // Sags are a small part of the length: twice as stiff is half the sag, within a fifth.
  assert.ok(Math.abs(stiff / soft - 0.5) < 0.1, `the sag of ${soft} m came to ${stiff} m`);
}

async function refusalsStandBesideTheirControl(page) {
  const path = 'body.0.elastic.neo-hookean.poisson',
    row = `[data-path="${path}"]`;
  await type(page, path, 0.7);
  await page.until(wanted => document.querySelector(`${wanted} .refusal`).textContent !== '', row);
  assert.match(await page.$eval(`${row} .refusal`, told => told.textContent), /0\.7/);
  assert.equal(await page.$eval(`${row} input`, field => field.valueAsNumber), 0.3);
  await type(page, path, 0.25);
  await page.until(wanted => document.querySelector(`${wanted} .refusal`).textContent === '', row);
  assert.equal(await control(page, path), 0.25);
}

async function aVertexIsDragged(page) {
  await settle(page);
  await press(page, '#play');
  await page.until(() => pliant.view.playing);
  await tip(page);
  const [x, y] = await page.evaluate(() => {
    const { left, top } = document.getElementById('picture').getBoundingClientRect(),
      [x, y] = pliant.project(0, window.tip);
    return [left + x, top + y];
  });
  const height = () => page.evaluate(() => pliant.project(0, window.tip)[1]);
  const before = await height(),
    camera = await page.evaluate(() => pliant.view.stage.camera.position.toArray());
  await page.keyboard.down('Shift');
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.until(() => pliant.view.grabbed !== null);
  for (let k = 1; k <= 60; k++) await page.mouse.move(x, y - k);
  await page.until(old => pliant.project(0, window.tip)[1] < old - 20, before);
  assert.ok(await page.evaluate(() => pliant.view.grab.string.visible), 'no string is drawn');
  await page.mouse.up();
  await page.keyboard.up('Shift');
  await page.until(() => pliant.view.grabbed === null && !pliant.view.grab.string.visible);
  assert.deepEqual(await page.evaluate(() => pliant.view.stage.camera.position.toArray()), camera);
  await page.until(old => pliant.project(0, window.tip)[1] > old - 5, before);
  const latencies = await page.evaluate(() => pliant.view.grab.latencies);
  latencies.sort((a, b) => a - b);
  const median = latencies[latencies.length >> 1];
  assert.deepEqual(page.faults, [], 'console');
  console.log(`median of ${latencies.length} latencies from a drag to its picture: ${median.toFixed(1)} ms`);
}

async function coloursAreThoseOfTheRun(page) {
  const names = await page.$$eval('#colouring option', found => found.map(option => option.textContent));
  const number = names.indexOf('von-mises');
  assert.ok(number > 1, names.join());
  await page.select('#colouring', String(number));
  await page.until(() => pliant.view.shown.values.length > 0 && pliant.view.numbers.valueRange);
  await page.until(() => Number(document.getElementById('legend-high').textContent) > 100);
  assert.equal(await page.$eval('#legend-name', name => name.textContent), 'von-mises [Pa]');
  // The pinned end is stressed more than the free one.
  const [root, free] = await page.evaluate(() => {
    const { bodies, shown } = pliant.view,
      x = k => bodies[0].place(bodies[0].triangles[3 * k], 0)[0];
    const ends = [...bodies[0].triangleElements.keys()].sort((a, b) => x(a) - x(b));
    return [ends[0], ends.at(-1)].map(k => shown.values[bodies[0].elements[bodies[0].triangleElements[k]]]);
  });
  assert.ok(root > 3 * free, `${root} at the pin, ${free} at the free end`);
}

async function schemesAreChosenAndRunsRecorded(page) {
  const file = `${folder}/live.mcap`;
  for (const old of ['live.mcap', 'live.commands.jsonl']) rmSync(`${folder}/${old}`, { force: true });
  await page.$eval('.recording input', field => (field.value = 'live.mcap'));
  await press(page, '.recording button');
  // The button follows with the next picture.
  await page.until(() => document.querySelector('.recording button').textContent === 'stop');
  await page.select('[data-path=integrator] select', 'implicit-midpoint');
  await page.until(() => pliant.view.controls.rows.get('integrator').control.value === 'implicit-midpoint');
  await press(page, '.recording button');
  await page.until(() => pliant.view.state.recording === null);
  assert.ok(existsSync(file), 'no recording');
}

async function everySizeInBothThemes(page) {
  // A screenshot waits for a page that draws without a pause.
  await page.keyboard.press(' ');
  await page.until(() => pliant.view.state.paused && !pliant.view.playing);
  for (const scheme of ['light', 'dark'])
    for (const width of [1280, 800, 400]) {
      await page.setViewport({ width, height: 800 });
      await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: scheme }]);
      await press(page, '#fit');
      const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      assert.equal(wide, 0, `the page is wider than ${width}`);
      writeFileSync(`${folder}/live-${scheme}-${width}.png`, await page.screenshot());
    }
  await page.setViewport({ width: 800, height: 600 });
  await press(page, '#play');
  await page.until(() => pliant.view.playing);
}

async function aSecondPageIsRefused(page) {
  const second = await watched(page.browser(), page.url());
  await second.waitForSelector('#notice:not([hidden])');
  assert.match(await second.$eval('#notice', notice => notice.textContent), /another page has it/);
  await second.close();
  const from = await step(page);
  await page.bringToFront();
  await page.until(old => pliant.view.shown.step > old, from);
}

async function aBodyThatIsReleasedFalls(page) {
  const [, , before] = await tip(page);
  await press(page, `[data-path="${PIN}"] input`);
  await page.until(old => pliant.view.bodies[0].place(window.tip, 0)[2] < old - 1, before);
  assert.equal(await control(page, PIN), false);
}

async function theEndOfTheRunIsTold(page, program) {
  assert.deepEqual(page.faults, [], 'console');
  const { origin, host, pathname } = new URL(program.address);
  assert.deepEqual(page.asked, [`${origin}${pathname}`, `ws://${host}${pathname}socket`], 'requests');
  assert.deepEqual(await page.evaluate(() => pliant.faults), []);
  program.removeAllListeners('exit');
  program.kill('SIGINT');
  await page.until(() => /has ended/.test(document.getElementById('notice').textContent));
}

/** Checks of one run, in this order. */
const RUNS = [
  [
    namesAreText,
    coloursAreThoseOfTheRun,
    schemesAreChosenAndRunsRecorded,
    everySizeInBothThemes,
    aSecondPageIsRefused,
    aBodyThatIsReleasedFalls,
    theEndOfTheRunIsTold,
  ],
  [pauseStepAndResetDoWhatTheySay, aStifferBeamSagsLess, refusalsStandBesideTheirControl, aVertexIsDragged],
];

async function run(checks) {
  const program = await serve('live.toml');
  const browser = await launch();
  try {
    const page = await open(browser, program.address);
    for (const check of checks) {
      await check(page, program);
      console.log('ok', check.name);
    }
  } catch (fault) {
    // At once: what closes below may fail too.
    console.error(fault);
    process.exitCode = 1;
  } finally {
    program.removeAllListeners('exit');
    program.kill();
    await browser.close();
  }
}

for (const checks of RUNS) await run(checks);
