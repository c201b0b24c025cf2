// The folder of the browser build in a headless Chromium: node site.mjs FOLDER PICTURES. FOLDER is what
// `make.mjs` wrote, PICTURES takes screenshots. Waits for what pages publish, never for a time.
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { extname, join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { launch } from './browser.mjs';

const [, , given, pictures] = process.argv;
const folder = resolve(given);
const STEPS = 9;
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css' };
/** Longest wait for something that a page is to show [ms]. */
const PATIENCE = 120000;

/** A web server that knows nothing but files. */
async function serve() {
  const server = createServer((question, answer) => {
    const path = join(folder, decodeURIComponent(new URL(question.url, 'http://site').pathname));
    try {
      const bytes = readFileSync(path);
      answer.writeHead(200, { 'content-type': TYPES[extname(path)] ?? 'application/octet-stream' });
      answer.end(bytes);
    } catch {
      answer.writeHead(404);
      answer.end();
    }
  });
  await new Promise(ready => server.listen(0, '127.0.0.1', ready));
  return server;
}

/** A page whose console is watched; `until` asks from here, because timers of a busy page may wait long. */
async function open(browser, address, { width = 1200, height = 900, scheme = 'light' } = {}) {
  const page = await browser.newPage();
  await page.setViewport({ width, height });
  await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: scheme }]);
  page.faults = [];
  page.on('console', m => {
    if (['error', 'warn'].includes(m.type()) && !/GPU stall/.test(m.text())) page.faults.push(m.text());
  });
  page.on('pageerror', fault => page.faults.push(String(fault)));
  page.until = async (test, ...more) => {
    for (const end = Date.now() + PATIENCE; !(await page.evaluate(test, ...more));) {
      if (Date.now() > end) throw new Error(`${address}: ${test}; ${page.faults.join('; ')}`);
      await new Promise(go => setTimeout(go, 40));
    }
  };
  await page.goto(address, { timeout: PATIENCE });
  return page;
}

const lesson = (browser, site, step, options) =>
  open(browser, `${site}/lecture/${step}.html?lang=en`, options);
const openEditor = (browser, site, hash = '', options) =>
  open(browser, `${site}/index.html?lang=en${hash}`, options);

/** Moves a slider as a hand does. */
const slide = (page, key, value) =>
  page.evaluate(
    (name, wanted) => {
      const slider = lecturePage.sliders.find(({ spec }) => spec.key === name),
        { min, max, step } = slider.range;
      const place =
        step === '1' && slider.spec.step === 1 ? wanted : Number(min) + slider.part(wanted) * (max - min);
      slider.range.value = place;
      slider.range.dispatchEvent(new Event('input'));
    },
    key,
    value,
  );
const choose = (page, key, value) =>
  page.evaluate(
    (name, wanted) => {
      const { choice, select } = lecturePage.choices.find(({ choice }) => choice.key === name);
      select.selectedIndex = choice.options.findIndex(([option]) => option === wanted);
      select.dispatchEvent(new Event('change'));
    },
    key,
    value,
  );
/** Five simulated seconds a second: a run as fast as it goes is far beyond its end before it pauses. */
const fast = page =>
  page.$eval('#speed', select => {
    select.value = [...select.options].findIndex(option => option.textContent === '5×');
    select.dispatchEvent(new Event('change'));
  });
const ended = page => page.until(() => lecturePage.ended && !lecturePage.playing);
/** The run after a change, which has other values than the one before. */
const restarted = (page, key) =>
  page.until(
    name => !lecturePage.busy && lecturePage.of?.[name] === lecturePage.values[name] && !lecturePage.ended,
    key,
  );

async function everyStepRuns(browser, site) {
  for (let step = 1; step <= STEPS; step++) {
    const page = await lesson(browser, site, step);
    await page.until(() => lecturePage.run.states.length > 0 && lecturePage.run.first);
    if (step === 5) await page.click('#play');
    await page.until(() => lecturePage.run.time > 0 && lecturePage.run.states.length > 3);
    await page.until(() => lecturePage.frame.contentWindow.pliant?.view?.shown?.step > 0);
    assert.deepEqual(await page.evaluate(() => lecturePage.frame.contentWindow.pliant.faults), []);
    assert.deepEqual(page.faults, [], `step ${step}`);
    await page.close();
  }
}

async function aSliderChangesTheMotion(browser, site) {
  const page = await lesson(browser, site, 1);
  await fast(page);
  await ended(page);
  const distance = stiffness =>
    page.evaluate(k => {
      const w = Math.sqrt(k);
      return Math.max(
        ...lecturePage.run.frames.map(({ time, x }) => Math.abs(x - 1 - (2 / w) * Math.sin(w * time))),
      );
    }, stiffness);
  // Symplectic Euler of step h is off by h v / 2 at most: 5 ms, 2 m/s.
  assert.ok((await distance(40)) < 0.006 && (await distance(160)) > 0.1);
  await slide(page, 'stiffness', 160);
  await restarted(page, 'stiffness');
  await ended(page);
  const stiffness = await page.evaluate(() => lecturePage.of.stiffness);
  assert.ok((await distance(stiffness)) < 0.006, 'the motion is not that of the stiffer spring');
  assert.ok((await distance(40)) > 0.1, 'the motion has not changed');
  await page.close();
}

async function theLimitIsAMarkAndLargerStepsAreRefused(browser, site) {
  const page = await lesson(browser, site, 2);
  await page.until(() => lecturePage.run.limit !== null);
  const limit = await page.evaluate(() => lecturePage.run.limit);
  // The message that names it has three digits.
  assert.ok(Math.abs(limit * Math.sqrt(40) - 2) < 0.005, `a limit of ${limit} s`);
  assert.ok(await page.$eval('.limit', mark => !mark.hidden && /316 ms/.test(mark.textContent)));
  await slide(page, 'step', 0.4);
  await page.until(() => /unstable.*316/s.test(document.querySelector('.notice.bad')?.textContent ?? ''));
  await choose(page, 'leave', 'yes');
  await fast(page);
  await page.until(() => lecturePage.run.states.at(-1)?.total > 1000);
  await choose(page, 'leave', 'no');
  await slide(page, 'step', 0.1);
  await page.until(() => document.querySelector('.notice').hidden && lecturePage.run.time > 1);
  await page.close();
}

/** Sliders that are dragged without a pause, on every page: what runs in the end are the last values. */
async function aHandThatDragsIsFollowed(browser, site) {
  for (let step = 1; step <= STEPS; step++) {
    const page = await lesson(browser, site, step);
    await page.until(() => lecturePage.run.first);
    await page.evaluate(async () => {
      for (let k = 0; k < 60; k++) {
        const { sliders, step } = lecturePage,
          { range } = sliders[k % sliders.length];
        // Steps stay below their limits, which the end of the drag is to run with.
        const least = Number(range.min),
          part = range.closest('.limited') ? 0.2 : 0.5;
        range.value = least + (range.max - least) * part * (0.5 + 0.5 * Math.sin(0.3 * k));
        range.dispatchEvent(new Event('input'));
        if (k % 3 === 0) await new Promise(go => setTimeout(go, 20));
      }
    });
    await page.until(() => !lecturePage.busy && !lecturePage.setting && lecturePage.run.states.length > 0);
    if (step === 5) await page.click('#play');
    await page.until(() => lecturePage.run.time > 0);
    assert.deepEqual(
      await page.evaluate(() => document.querySelector('.notice.bad:not([hidden])')?.textContent),
      undefined,
    );
    const controls = await page.evaluate(() => {
      const { rows } = lecturePage.frame.contentWindow.pliant.view.controls;
      const { values, step } = lecturePage;
      return step.sliders
        .map(({ key, path }) => [typeof path === 'function' ? path(values) : path, values[key]])
        .filter(([path]) => path)
        .map(([path, wanted]) => [path, rows.get(path).control.value, wanted]);
    });
    for (const [path, own, wanted] of controls) {
      assert.ok(
        Math.abs(own - wanted) <= 1e-3 * Math.abs(wanted),
        `step ${step}: ${path} is ${own}, not ${wanted}`,
      );
    }
    assert.deepEqual(page.faults, [], `step ${step}`);
    await page.close();
  }
}

async function aStoppedModuleIsReplaced(browser, site) {
  const page = await openEditor(browser, site);
  const runs = () => document.getElementById('page').contentWindow?.pliant?.view?.shown?.step > 5;
  await page.until(runs);
  await page.evaluate(() => shell.engine.worker.postMessage({ do: 'what no worker can' }));
  await page.until(() => /stopped/.test(document.getElementById('wait').textContent));
  await page.click('#run');
  await page.until(runs);
  await page.close();
}

async function energiesFollowTheirFormulas(browser, site) {
  const page = await lesson(browser, site, 2);
  for (const [name, power] of [
    ['forward-euler', 1],
    ['implicit-euler', -1],
  ]) {
    await choose(page, 'integrator', name);
    await restarted(page, 'integrator');
    await fast(page);
    await ended(page);
    const off = await page.evaluate(n => {
      const { of, run } = lecturePage,
        growth = 1 + of.stiffness * of.step ** 2,
        first = 0.5 * of.speed ** 2;
      const formula = step => first * growth ** (n * step);
      // Beyond that, the spring is pressed through its support.
      const linear = run.states.filter(({ step }) => formula(step) < 0.5 * of.stiffness);
      return Math.max(...linear.map(({ step, total }) => Math.abs(total / formula(step) - 1)));
    }, power);
    assert.ok(off < 1e-6, `${name} is off its formula by ${off}`);
  }
  await page.close();
}

async function densitiesAreThoseOfTheFormula(browser, site) {
  const page = await lesson(browser, site, 5);
  for (const material of ['linear', 'stvk', 'corotated']) {
    await choose(page, 'material', material);
    await slide(page, 'angle', 60);
    await slide(page, 'stretch', 0.7);
    await page.until(
      name =>
        !lecturePage.busy &&
        lecturePage.of?.material === name &&
        lecturePage.of.stretch < 0.71 &&
        lecturePage.run.states.length > 0,
      material,
    );
    const [own, formula] = await page.evaluate(() => [
      lecturePage.run.states[0].elastic,
      DENSITY[lecturePage.of.material](gradientOf(lecturePage.of), lame(lecturePage.of)),
    ]);
    assert.ok(Math.abs(own / formula - 1) < 1e-9, `${material}: ${own} for ${formula}`);
  }
  await page.close();
}

async function quadraticElementsMeetBeamTheory(browser, site) {
  const page = await lesson(browser, site, 6);
  const error = () =>
    page.evaluate(() => Math.abs(lecturePage.run.frames.at(-1).fall / deflectionByTheory - 1));
  await fast(page);
  await ended(page);
  const linear = await error();
  await choose(page, 'order', 2);
  await restarted(page, 'order');
  await ended(page);
  const quadratic = await error();
  assert.ok(linear > 0.2 && quadratic < 0.01, `errors of ${linear} and ${quadratic}`);
  assert.equal(await page.evaluate(() => lecturePage.run.session.size), 2);
  await page.close();
}

async function elementsTurnRightAndSpringsDoNot(browser, site) {
  const page = await lesson(browser, site, 7);
  for (const [material, least, most] of [
    ['corotated', 0, 0],
    ['springs', 60, 72],
    ['stvk', 72, 72],
  ]) {
    await choose(page, 'material', material);
    await page.until(name => !lecturePage.busy && lecturePage.of?.material === name, material);
    await fast(page);
    await ended(page);
    const { first, last } = await page.evaluate(() => ({
      first: lecturePage.run.frames[0].inverted,
      last: lecturePage.run.frames.at(-1).inverted,
    }));
    assert.ok(first === 72 && last >= least && last <= most, `${material}: ${first}, then ${last}`);
  }
  await page.close();
}

async function theEditorShowsMistakesAtTheirLine(browser, site) {
  const page = await openEditor(browser, site);
  await page.until(() => document.getElementById('page').contentWindow?.pliant?.view?.shown?.step > 5);
  await page.evaluate(() => {
    const { field } = shell;
    field.text = field.text.replace('poisson = 0.0', 'poisson = 0.7');
    document.getElementById('run').click();
  });
  await page.until(() => !document.querySelector('.mistake').hidden);
  const { line, said, marked } = await page.evaluate(() => ({
    line: shell.field.text.split('\n').findIndex(line => line.includes('0.7')) + 1,
    said: document.querySelector('.mistake').textContent,
    marked:
      [...document.querySelectorAll('.numbers div')].findIndex(row => row.classList.contains('wrong')) + 1,
  }));
  assert.equal(marked, line);
  assert.match(said, new RegExp(`line ${line}, column`));
  await page.close();
}

async function aLinkIsAnExperiment(browser, site) {
  const page = await openEditor(browser, site);
  await page.until(() => !shell.busy && shell.isReady);
  const address = await page.evaluate(async () => {
    shell.field.text = shell.field.text.replace('young = 3e6', 'young = 4e6');
    await shell.copyLink();
    return location.href;
  });
  assert.match(address, /#scene=[-\w]+$/);
  await page.close();
  const other = await open(browser, address);
  await other.until(() => document.getElementById('page').contentWindow?.pliant?.view?.shown?.step > 5);
  assert.match(await other.evaluate(() => shell.field.text), /young = 4e6/);
  await other.close();
}

async function meshesAreDroppedAndRecordingsDownloaded(browser, site) {
  const page = await openEditor(browser, site);
  await page.until(() => !shell.busy && shell.isReady);
  await page.evaluate(async () => {
    const square = 'v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n';
    const scene = `dimension = 3
[time]
integrator = "symplectic-euler"
step = "1 ms"
duration = 1
[world]
gravity = [0, 0, -9.81]
[[body]]
name = "sheet"
mesh = { file = { path = "square.obj" } }
springs = { stiffness = 100 }
mass = { per_vertex = 1 }
`;
    const files = new DataTransfer();
    files.items.add(new File([square], 'square.obj'));
    files.items.add(new File([scene], 'sheet.toml'));
    dispatchEvent(new DragEvent('drop', { dataTransfer: files, bubbles: true, cancelable: true }));
  });
  await page.until(
    () => document.getElementById('page').contentWindow?.pliant?.view?.bodies?.[0]?.name === 'sheet',
  );
  await page.until(() => document.getElementById('page').contentWindow.pliant.view.shown?.step > 5);
  const magic = await page.evaluate(async () => {
    const { bytes, message } = await shell.engine.download();
    return bytes ? [...new Uint8Array(bytes, 0, 5)] : message;
  });
  assert.deepEqual(magic, [0x89, ...Buffer.from('MCAP')]);
  await page.close();
}

async function bitsAreThoseOfTheNativeProgram(browser, site) {
  const page = await openEditor(browser, site);
  await page.until(() => !shell.busy && shell.isReady);
  if (await page.$eval('#bits', button => button.hidden)) console.log('no native bits to compare with');
  else {
    await page.click('#bits');
    await page.until(() => /^(equal|other)/.test(document.getElementById('said').textContent));
    assert.match(await page.$eval('#said', said => said.textContent), /^equal to native: 50 steps/);
  }
  await page.close();
}

async function pagesFromFilesRun(browser) {
  const site = pathToFileURL(folder).href;
  const page = await lesson(browser, site, 4);
  await page.until(() => lecturePage.run.time > 0.05);
  assert.deepEqual(page.faults, []);
  await page.close();
  const editor = await openEditor(browser, site, '#shipped=tuning_fork');
  await editor.until(() => document.getElementById('page').contentWindow?.pliant?.view?.shown?.step > 2);
  assert.deepEqual(editor.faults, []);
  await editor.close();
}

async function everySizeInBothThemesAndLanguages(browser, site) {
  mkdirSync(pictures, { recursive: true });
  for (const language of ['en', 'zh']) {
    for (const name of ['index', ...Array.from({ length: STEPS }, (_, k) => String(k + 1)), 'editor']) {
      const path = name === 'editor' ? 'index.html' : `lecture/${name}.html`;
      const page = await open(browser, `${site}/${path}?lang=${language}`);
      if (name === 'editor')
        await page.until(
          () => document.getElementById('page').contentWindow?.pliant?.view?.shown?.time > 0.2,
        );
      else if (name !== 'index' && name !== '5') await page.until(() => lecturePage.run.time > 0.3);
      else if (name === '5') await page.until(() => lecturePage.run.states.length > 0);
      for (const scheme of ['light', 'dark']) {
        await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: scheme }]);
        for (const width of [390, 1200]) {
          await page.setViewport({ width, height: width === 390 ? 800 : 1250 });
          if (name === 'editor') {
            await page.evaluate(() => document.getElementById('page').contentDocument.getElementById('fit').click());
          }
          const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
          assert.ok(wide <= 0, `${path} is wider than ${width}`);
          const fullPage = width === 390 && name !== 'editor';
          const picture = await page.screenshot({ fullPage });
          writeFileSync(join(pictures, `${name}-${width}-${scheme}-${language}.png`), picture);
        }
      }
      assert.deepEqual(page.faults, [], path);
      await page.close();
    }
  }
}

const CHECKS = [
  everyStepRuns,
  aSliderChangesTheMotion,
  theLimitIsAMarkAndLargerStepsAreRefused,
  aHandThatDragsIsFollowed,
  aStoppedModuleIsReplaced,
  energiesFollowTheirFormulas,
  densitiesAreThoseOfTheFormula,
  quadraticElementsMeetBeamTheory,
  elementsTurnRightAndSpringsDoNot,
  theEditorShowsMistakesAtTheirLine,
  aLinkIsAnExperiment,
  meshesAreDroppedAndRecordingsDownloaded,
  bitsAreThoseOfTheNativeProgram,
  pagesFromFilesRun,
  everySizeInBothThemesAndLanguages,
];

const server = process.env.SITE ? null : await serve();
const site = process.env.SITE ?? `http://127.0.0.1:${server.address().port}`;
const browser = await launch();
const only = process.argv.slice(4);
try {
  for (const check of CHECKS.filter(({ name }) => !only.length || only.includes(name))) {
    await check(browser, site);
    console.log('ok', check.name);
  }
} catch (fault) {
  console.error(fault);
  process.exitCode = 1;
} finally {
  await browser.close();
  server?.close();
}
