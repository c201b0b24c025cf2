// Opens pages of `pliant view` in a headless Chromium and looks at them: node view_page.mjs FOLDER, which
// holds two_bodies.html, flat.html and hair.html. Waits for what the page publishes, never for a time.
import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import { launch, watched } from './browser.mjs';

const folder = process.argv[2];
const browser = await launch();

async function open(name, size = {}) {
  const { width = 800, scheme = 'light' } = size,
    address = `file://${folder}/${name}.html`;
  const page = await watched(browser, address, size);
  page.close_clean = async () => {
    writeFileSync(`${folder}/${name}-${scheme}-${width}.png`, await page.screenshot());
    assert.deepEqual(page.faults, [], `${name}: console`);
    assert.deepEqual(page.asked, [address], `${name}: requests`);
    assert.deepEqual(await page.evaluate(() => pliant.faults), []);
    await page.close();
  };
  return page;
}

/** Box and number of pixels that are drawn by bodies: where picking without decoration would find them. */
const drawn = (page, colour) =>
  page.evaluate(wanted => {
    const { stage } = pliant.view,
      gl = stage.renderer.getContext();
    stage.decor.visible = stage.arrows.visible = false;
    stage.draw();
    const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight],
      pixels = new Uint8Array(4 * w * h);
    gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    stage.decor.visible = stage.arrows.visible = true;
    // Shades of one colour keep their ratios.
    const near = k => {
      const s = Math.max(...[0, 1, 2].map(c => pixels[4 * k + c])) / Math.max(...wanted);
      return s > 0.2 && [0, 1, 2].every(c => Math.abs(pixels[4 * k + c] - s * wanted[c]) < 12);
    };
    const box = [w, h, 0, 0];
    let count = 0;
    for (let k = 0; k < w * h; k++)
      if (near(k)) {
        const x = k % w,
          y = h - 1 - Math.floor(k / w);
        count++;
        box[0] = Math.min(box[0], x);
        box[1] = Math.min(box[1], y);
        box[2] = Math.max(box[2], x);
        box[3] = Math.max(box[3], y);
      }
    return { count, box };
  }, colour);

/** Box of the projected vertices of a body. */
const expected = (page, body) =>
  page.evaluate(number => {
    const body = pliant.view.bodies[number],
      box = [1e9, 1e9, -1e9, -1e9];
    for (let v = 0; v < body.count; v++) {
      const [x, y] = pliant.project(number, v);
      box[0] = Math.min(box[0], x);
      box[1] = Math.min(box[1], y);
      box[2] = Math.max(box[2], x);
      box[3] = Math.max(box[3], y);
    }
    return box;
  }, body);

function sameBox(found, wanted, within, message) {
  found.forEach((c, k) =>
    assert.ok(Math.abs(c - wanted[k]) < within, `${message}: ${found} instead of ${wanted}`),
  );
}

const state = page =>
  page.evaluate(() => ({
    frame: pliant.frame,
    drawn: pliant.drawn,
    colouring: pliant.colouring,
    frames: pliant.frames,
    title: document.title,
    playing: pliant.view.playing,
  }));
const until = (page, test, ...given) => page.waitForFunction(test, { timeout: 20000, polling: 30 }, ...given);

async function bodiesAreWhereTheyAre() {
  const page = await open('two_bodies');
  const first = await state(page);
  assert.equal(first.frames, 51);
  assert.ok(first.title.startsWith('</script><script>window.broken'), first.title);
  assert.equal(await page.evaluate(() => window.broken), undefined, 'markup in the title ran');
  assert.equal(await page.$eval('#title', title => title.children.length), 0);
  const [blue, orange] = await page.evaluate(() => pliant.view.recording.bodies.map(body => body.colour));
  let last;
  for (const frame of [0, 25, 50]) {
    await page.evaluate(f => pliant.show(f), frame);
    assert.equal((await state(page)).drawn, frame);
    const falling = await drawn(page, orange),
      held = await drawn(page, blue);
    assert.ok(falling.count > 500 && held.count > 500, `${falling.count} and ${held.count} pixels`);
    sameBox(falling.box, await expected(page, 1), 3, `the falling body in frame ${frame}`);
    if (last) assert.ok(falling.box[3] > last[3] + 3, `it does not fall: ${last} ${falling.box}`);
    last = falling.box;
  }
  await page.close_clean();
}

async function coloursAreThoseOfNumbers() {
  const page = await open('two_bodies');
  await page.evaluate(() => pliant.show(50));
  const names = await page.evaluate(() => pliant.view.recording.colourings.map(colouring => colouring.name));
  assert.deepEqual(names, ['body', 'speed', 'displacement', 'jacobian', 'von-mises']);
  await page.select('#colouring', '1');
  await until(page, () => pliant.colouring === 'speed' && pliant.drawn === 50);
  // Free fall for a second at 1 m/s^2, the largest speed there is: the light end of the map.
  const legend = await page.$eval('#legend', legend => legend.textContent.replace(/\s+/g, ' '));
  assert.match(legend, /speed \[m\/s\]/);
  const high = await page.$eval('#legend-high', end => Number(end.textContent));
  assert.ok(Math.abs(high - 1) < 1e-3, `largest speed ${high}`);
  assert.ok((await drawn(page, [0xfd, 0xe7, 0x25])).count > 500, 'the falling body is not yellow');
  // All of it is as fast: one colour on the range of this frame is its end still.
  await page.select('#range', 'frame');
  assert.equal(
    await page.$eval('#legend-high', end => end.textContent),
    await page.evaluate(() =>
      String(Number(pliant.view.value(pliant.view.recording.colourings[1], 65534).toPrecision(4))),
    ),
  );
  // The stress of what falls freely is small, so it is dark; what is held is stressed most.
  await page.select('#range', 'fixed');
  await page.select('#colouring', '4');
  await until(page, () => pliant.colouring === 'von-mises');
  assert.match(await page.$eval('#legend-name', name => name.textContent), /von-mises \[Pa\]/);
  assert.equal((await drawn(page, [0xfd, 0xe7, 0x25])).count < 20000, true);
  assert.ok((await drawn(page, [0x44, 0x01, 0x54])).count > 500, 'the falling body is not dark');
  await page.close_clean();
}

async function keysAndScrubbing() {
  const page = await open('two_bodies');
  const press = async (key, frame) => {
    await page.keyboard.press(key);
    await until(page, wanted => pliant.frame === wanted && pliant.drawn === wanted, frame);
  };
  await press('ArrowRight', 1);
  await press('ArrowRight', 2);
  await press('ArrowLeft', 1);
  await press('End', 50);
  await press('Home', 0);
  await page.keyboard.press('c');
  assert.equal((await state(page)).colouring, 'speed');
  await page.keyboard.press('h');
  assert.equal(await page.$eval('#help', help => help.hidden), false);
  await page.keyboard.press('Escape');
  assert.equal(await page.$eval('#help', help => help.hidden), true);
  const paper = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const light = await paper();
  await page.keyboard.press('t');
  assert.notEqual(await paper(), light);
  // The time line and the chart.
  const at = async (selector, part) => {
    const box = await (await page.$(selector)).boundingBox();
    await page.mouse.click(box.x + part * box.width, box.y + box.height / 2);
  };
  await at('#time', 0.5);
  await until(page, () => Math.abs(pliant.frame - 25) <= 2);
  await at('#chart-picture', 0.98);
  await until(page, () => pliant.frame >= 48);
  await page.evaluate(() => {
    document.activeElement.blur();
    pliant.show(0);
  });
  await page.keyboard.press(' ');
  await until(page, () => pliant.view.playing && pliant.drawn > 3);
  await page.keyboard.press(' ');
  assert.equal((await state(page)).playing, false);
  await page.close_clean();
}

async function clicksFindVertices() {
  const page = await open('two_bodies');
  const hits = await page.evaluate(() => {
    let hits = 0;
    for (let v = 0; v < pliant.view.bodies[1].count; v++) {
      const [x, y] = pliant.project(1, v),
        chosen = pliant.view.inspector.choose(x, y);
      hits += chosen?.body.name === 'falling' && chosen.vertex === v;
    }
    pliant.view.inspector.close();
    return hits;
  });
  // Of 26 vertices 19 are on the three sides that are seen; those of the outline may lie a pixel beside it.
  assert.ok(hits >= 8 && hits <= 19, `${hits} vertices found`);
  await page.evaluate(() => pliant.show(50));
  const box = await (await page.$('#picture')).boundingBox(),
    [x0, y0, x1, y1] = await expected(page, 1);
  await page.mouse.click(box.x + (x0 + x1) / 2, box.y + (y0 + y1) / 2);
  await page.waitForSelector('#inspector:not([hidden])');
  const text = await page.$eval('#inspector-rows', rows => rows.textContent);
  assert.match(text, /bodyfalling.*vertex\d+.*element\d+.*position.* m.*velocity.*speed1 m\/s.*von-mises/s);
  // An empty place closes it.
  await page.mouse.click(box.x + box.width - 5, box.y + box.height - 5);
  await page.waitForSelector('#inspector', { hidden: true });
  const label = await page.$eval('.probe', probe => probe.textContent);
  assert.equal(label, 'top');
  await page.close_clean();
}

async function loadsAreArrows() {
  const page = await open('two_bodies');
  const arrows = frame =>
    page.evaluate(f => {
      pliant.show(f);
      const tip = arrow => arrow.children[0].localToWorld(arrow.position.clone().set(0, 1, 0)),
        down = arrow => tip(arrow).sub(arrow.position);
      const { loads, gravity } = pliant.view.loads;
      const shown = loads[0].arrows.filter(arrow => arrow.visible);
      return {
        places: shown.map(arrow => arrow.position.toArray()),
        ways: [...shown, gravity].map(arrow => down(arrow).toArray()),
        label: loads[0].label.element.textContent,
        g: gravity.visible,
      };
    }, frame);
  assert.equal((await arrows(0)).places.length, 0, 'nothing presses at t = 0');
  const half = await arrows(25),
    end = await arrows(50);
  assert.equal(end.places.length, 8);
  assert.ok(end.g);
  assert.equal(end.label, 'traction 20 Pa');
  end.places.forEach(place => assert.ok(Math.abs(place[2] - 1) < 0.05, `on the top, not at ${place}`));
  end.ways.forEach(([x, y, z]) => assert.ok(z < 0 && Math.hypot(x, y) < 1e-6 * -z, `down, not ${[x, y, z]}`));
  const share = half.ways[0][2] / end.ways[0][2];
  assert.ok(Math.abs(share - 0.5) < 0.01, `half as long after half the time: ${share}`);
  await page.close_clean();
}

async function fingersTurnAndZoom() {
  const page = await open('two_bodies');
  const client = await page.createCDPSession();
  const touch = (type, ...points) =>
    client.send('Input.dispatchTouchEvent', {
      type,
      touchPoints: points.map(([x, y], id) => ({ x, y, id })),
    });
  const camera = () =>
    page.evaluate(() => {
      const { camera, controls } = pliant.view.stage,
        from = camera.position.clone().sub(controls.target);
      return { azimuth: Math.atan2(from.y, from.x), distance: from.length() };
    });
  const { x, y, width, height } = await (await page.$('#picture')).boundingBox(),
    at = dx => [x + width / 2 + dx, y + height / 2];
  const before = await camera();
  await touch('touchStart', at(0));
  for (let k = 1; k <= 6; k++) await touch('touchMove', at(10 * k));
  await touch('touchEnd');
  const turned = await camera();
  assert.ok(Math.abs(turned.azimuth - before.azimuth) > 0.1, 'one finger turns');
  assert.ok(Math.abs(turned.distance / before.distance - 1) < 1e-6, 'and keeps the distance');
  await touch('touchStart', at(-50), at(50));
  for (let k = 1; k <= 5; k++) await touch('touchMove', at(-50 - 10 * k), at(50 + 10 * k));
  await touch('touchEnd');
  // Twice as far apart, half as far away.
  const ratio = (await camera()).distance / turned.distance;
  assert.ok(ratio > 0.4 && ratio < 0.65, `two fingers: ${ratio}`);
  await page.close_clean();
}

async function lostContextComesBack() {
  const page = await open('two_bodies');
  const blue = await page.evaluate(() => pliant.view.recording.bodies[0].colour);
  const before = await drawn(page, blue);
  const message = () => page.$eval('#message', place => place.textContent);
  await page.evaluate(() => {
    const { renderer } = pliant.view.stage;
    window.loss = renderer.getContext().getExtension('WEBGL_lose_context');
    window.loss.loseContext();
  });
  await until(page, () => /context was lost/.test(document.getElementById('message').textContent));
  await page.evaluate(() => window.loss.restoreContext());
  await until(page, () => document.getElementById('message').textContent === '');
  assert.equal(await message(), '');
  assert.deepEqual(await drawn(page, blue), before);
  await page.close_clean();
}

async function everyKindInBothThemesAndThreeSizes() {
  for (const name of ['two_bodies', 'flat', 'hair'])
    for (const scheme of ['light', 'dark'])
      for (const width of [1200, 800, 400]) {
        const page = await open(name, { width, scheme });
        await page.evaluate(() => pliant.show(pliant.frames >> 1));
        const colour = await page.evaluate(() => pliant.view.recording.bodies[0].colour);
        const found = await drawn(page, colour),
          wanted = await expected(page, 0);
        assert.ok(found.count > 50, `${name}: ${found.count} pixels`);
        // Overlays of HTML are not in the picture; pins are, and lines have a width.
        sameBox(found.box, wanted, 8, `${name}, ${scheme}, ${width}`);
        const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
        assert.equal(wide, 0, `${name} is wider than ${width}`);
        await page.close_clean();
      }
}

try {
  for (const check of [
    bodiesAreWhereTheyAre,
    coloursAreThoseOfNumbers,
    keysAndScrubbing,
    clicksFindVertices,
    loadsAreArrows,
    fingersTurnAndZoom,
    lostContextComesBack,
    everyKindInBothThemesAndThreeSizes,
  ]) {
    await check();
    console.log('ok', check.name);
  }
} finally {
  await browser.close();
}
