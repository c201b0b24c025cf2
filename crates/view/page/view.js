// A recording that is played: keeps picture, chart and controls together.
import * as THREE from 'three';
import { MISSING } from 'pliant/data';
import { Body } from 'pliant/body';
import { Stage, metres } from 'pliant/stage';
import { Chart, brief } from 'pliant/charts';
import { Loads } from 'pliant/loads';
import { Inspector } from 'pliant/inspector';
import { by, choices, fillHelp, paintBar, showLegend, takesKey, turnTheme } from 'pliant/panel';

/** Largest code of a number. */
export const LARGEST = MISSING - 1;
/** Darkness of edges. */
const EDGES = 0.4;
/** Bodies go far whose way is so many times as large as they are. */
const FAR = 3;
const SPEEDS = [1 / 16, 1 / 8, 1 / 4, 1 / 2, 1, 2, 4, 8, 16];

export class View {
  constructor(recording) {
    Object.assign(this, { recording, frame: 0, colouring: 0, playing: false, drawnFrame: -1 });
    this.stage = new Stage(by('picture'), by('labels'), recording.dimension === 2);
    const map = new Uint8Array(256 * 4).fill(255);
    for (let k = 0; k < 256; k++) map.set(recording.colour_map.slice(3 * k, 3 * k + 3), 4 * k);
    const colourMap = new THREE.DataTexture(map, 256, 1);
    colourMap.needsUpdate = true;
    this.shared = { ...this.stage.shared, colourMap: { value: colourMap } };
    this.bodies = recording.bodies.map((_, number) => new Body(recording, number, this.shared));
    this.stage.onDrawn = () => {
      this.drawnFrame = this.frame;
    };
    this.stage.onLost = lost => {
      by('message').textContent = lost ? 'The graphics context was lost; waiting for it.' : '';
    };
  }

  get last() {
    return this.recording.times.length - 1;
  }

  async start() {
    for (const body of this.bodies) {
      await body.readLists();
      body.prepare();
      await body.positions.read(0);
      body.objects.forEach(object => this.stage.scene.add(object));
    }
    this.stage.shared.thickness.value = this.bodies.some(body => body.lines.length > 4000) ? 1.2 : 2.2;
    this.#describe();
    this.inspector = new Inspector(this);
    this.loads = new Loads(this.recording, this.bodies, this.stage);
    this.#probes();
    this.#look();
    await this.#readAll(0);
    this.show(0);
    this.stage.draw();
    by('message').textContent = '';
    for (let chunk = 1; chunk < this.bodies[0].positions.chunkCount; chunk++) await this.#readAll(chunk);
    this.#listen();
    this.show(this.frame);
    this.stage.draw();
  }

  async #readAll(chunk) {
    for (const body of this.bodies) {
      await body.positions.read(chunk);
      for (const colouring of body.colourings) await colouring?.series.read(chunk);
    }
  }

  boxOf(frame) {
    const box = new THREE.Box3();
    this.bodies.forEach(body => body.extend(box, frame));
    if (box.isEmpty()) box.set(new THREE.Vector3(-1, -1, -1), new THREE.Vector3(1, 1, 1));
    return box;
  }

  /** Box of all frames, from the head: nothing has to be unpacked for it. */
  #wayBox() {
    const box = new THREE.Box3();
    for (const { low, step, centres, vertex_count: count } of this.recording.bodies) {
      if (!count) continue;
      for (const centre of centres.length ? centres : [[0, 0, 0]]) {
        box.expandByPoint(new THREE.Vector3(...low.map((c, axis) => c + centre[axis])));
        box.expandByPoint(
          new THREE.Vector3(...low.map((c, axis) => c + centre[axis] + step[axis] * LARGEST)),
        );
      }
    }
    return box.isEmpty() ? this.boxOf(0) : box;
  }

  /** First look: at the whole way of the bodies; where they go far, at their start, and it follows them. */
  #look() {
    const size = box => box.getSize(new THREE.Vector3()).length(),
      start = this.boxOf(0);
    this.way = this.#wayBox();
    const far = size(this.way) > FAR * size(start);
    by('follow').checked = far;
    this.focus = far ? start : this.way;
    this.redecorate();
    this.stage.fit(this.focus, true);
  }

  #describe() {
    const { recording } = this;
    document.title = recording.title;
    by('title').textContent = by('title').title = recording.title;
    const notes = [];
    if (recording.frames.length < recording.frame_count) {
      notes.push(`every ${recording.frames[1] - recording.frames[0]}th of ${recording.frame_count} frames`);
    }
    if (recording.left_out.length) notes.push(`left out: ${recording.left_out.join(', ')}`);
    by('note').textContent = notes.join('; ');
    choices(
      by('colouring'),
      recording.colourings.map(colouring => colouring.name),
    );
    const duration = recording.times.at(-1) - recording.times[0] || 1;
    this.pace = duration > 0.5 && duration < 60 ? 1 : 10 ** Math.round(Math.log10(duration / 6));
    choices(
      by('speed'),
      SPEEDS.map(factor => `${brief(factor * this.pace)}×`),
    );
    by('speed').value = SPEEDS.indexOf(1);
    by('time').max = this.last;
    this.chart = new Chart(by('chart-picture'), by('chart-legend'), recording.times, frame =>
      this.seek(frame),
    );
    choices(
      by('chart'),
      recording.charts.map(chart => chart.name),
    );
    by('chart').hidden = by('chart-box').hidden = recording.charts.length === 0;
    if (recording.charts.length) this.chart.show(recording.charts[0]);
    const step = Math.max(...recording.bodies.flatMap(body => body.step));
    fillHelp(
      `Positions are shown to ${metres(step / 2)}; numbers at vertices and elements to 1e-5 of their range.`,
    );
    paintBar(recording.colour_map);
  }

  #probes() {
    this.recording.probes.forEach((name, k) =>
      this.stage.mark('probe', name, () => this.recording.probe_positions[this.frame][k]),
    );
  }

  /** Value of a code. */
  value(colouring, code) {
    const [low, high] = colouring.range;
    return code === MISSING ? NaN : low + ((high - low) * code) / LARGEST;
  }

  /** Codes between which colours are spread. */
  #codeRange() {
    if (by('range').value === 'fixed') return [0, LARGEST];
    const ranges = this.bodies.map(body => body.codeRange(this.frame, this.colouring)).filter(Boolean);
    return ranges.length
      ? [Math.min(...ranges.map(r => r[0])), Math.max(...ranges.map(r => r[1]))]
      : [0, LARGEST];
  }

  /** Shows a frame. */
  show(frame) {
    const before = this.frame;
    this.frame = Math.min(this.last, Math.max(0, frame));
    if (!this.bodies.every(body => body.has(this.frame))) return;
    const [low, high] = this.#codeRange(),
      colouring = this.recording.colourings[this.colouring];
    for (const body of this.bodies) {
      body.uniforms.range.value.set(low, high);
      body.show(this.frame, this.colouring, this.playing);
    }
    this.loads.show(this.frame);
    if (by('follow').checked && before !== this.frame) this.#follow(before);
    showLegend(
      colouring,
      colouring.range && [low, high].map(code => this.value(colouring, code)),
      this.recording.bodies,
    );
    this.showTime();
    this.inspector.refresh();
    this.stage.ask();
  }

  showTime() {
    by('time').value = this.frame;
    by('clock').textContent =
      `${brief(this.recording.times[this.frame])} s · frame ${this.recording.frames[this.frame]}`;
    this.chart.frame = this.frame;
    this.chart.draw();
  }

  /** Mean of all vertices in a frame [m]. */
  centre(frame) {
    const sum = this.bodies.map(body => body.sum(frame)).reduce((a, b) => a.add(b));
    return sum.divideScalar(this.bodies.reduce((total, body) => total + body.count, 0) || 1);
  }

  #follow(before) {
    this.stage.move(this.centre(this.frame).sub(this.centre(before)));
  }

  seek(frame) {
    this.show(frame);
    this.playhead = this.recording.times[this.frame];
  }

  forward() {
    this.seek(this.frame + 1);
  }

  play(on) {
    if (this.playing === on) return;
    this.playing = on;
    by('play').textContent = on ? '❚❚' : '▶';
    if (!on) {
      this.show(this.frame);
      return;
    }
    if (this.frame === this.last) this.seek(0);
    this.playhead = this.recording.times[this.frame];
    this.clock = undefined;
    requestAnimationFrame(now => this.#tick(now));
  }

  #tick(now) {
    if (!this.playing) return;
    const { times } = this.recording,
      elapsed = this.clock === undefined ? 0 : Math.min(0.25, (now - this.clock) / 1000);
    this.clock = now;
    this.playhead += elapsed * this.pace * SPEEDS[by('speed').value];
    if (this.playhead > times.at(-1)) {
      if (!by('loop').checked) {
        this.show(this.last);
        this.play(false);
        return;
      }
      this.playhead = times[0];
    }
    let frame = this.frame;
    if (times[frame] > this.playhead) frame = 0;
    while (frame < this.last && times[frame + 1] <= this.playhead) frame++;
    if (frame !== this.frame) this.show(frame);
    requestAnimationFrame(later => this.#tick(later));
  }

  colourBy(number) {
    this.colouring = number;
    by('colouring').value = number;
    this.show(this.frame);
  }

  redecorate() {
    this.stage.decorate(this.way, this.focus, this.recording.walls);
    by('scale').textContent = `grid ${metres(this.stage.step)}`;
    this.stage.grid.visible = by('grid').checked;
    this.loads.show(this.frame);
    this.chart.draw();
    this.stage.ask();
  }

  #listen() {
    const on = (id, event, act) => by(id).addEventListener(event, act);
    on('play', 'click', () => this.play(!this.playing));
    on('back', 'click', () => this.seek(this.frame - 1));
    on('forward', 'click', () => this.forward());
    on('time', 'input', () => this.seek(Number(by('time').value)));
    on('colouring', 'change', () => this.colourBy(Number(by('colouring').value)));
    on('range', 'change', () => this.show(this.frame));
    on('edges', 'change', () => {
      this.stage.edges.value = by('edges').checked ? EDGES : 0;
      this.stage.ask();
    });
    on('grid', 'change', () => this.redecorate());
    on('fit', 'click', () => this.stage.fit(this.boxOf(this.frame), false));
    on('theme', 'click', () => {
      turnTheme();
      this.redecorate();
    });
    on('help-button', 'click', () => this.help());
    on('chart', 'change', () => this.chart.show(this.recording.charts[by('chart').value]));
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.redecorate());
    addEventListener('keydown', event => this.#key(event));
  }

  help() {
    by('help').hidden = !by('help').hidden;
  }

  /** Actions by key. */
  keys() {
    const toggle = id => () => by(id).click();
    const faster = step => () => {
      by('speed').value = Math.min(SPEEDS.length - 1, Math.max(0, Number(by('speed').value) + step));
    };
    return {
      ' ': () => this.play(!this.playing),
      ArrowRight: () => this.forward(),
      ArrowLeft: () => this.seek(this.frame - 1),
      Home: () => this.seek(0),
      End: () => this.seek(this.last),
      '+': faster(1),
      '=': faster(1),
      '-': faster(-1),
      l: toggle('loop'),
      f: toggle('fit'),
      o: toggle('follow'),
      e: toggle('edges'),
      g: toggle('grid'),
      c: () => this.colourBy((this.colouring + 1) % this.recording.colourings.length),
      r: () => this.turnRange(),
      t: toggle('theme'),
      '?': () => this.help(),
      h: () => this.help(),
      Escape: () => {
        by('help').hidden = true;
        this.inspector.close();
      },
    };
  }

  turnRange() {
    by('range').value = by('range').value === 'fixed' ? 'frame' : 'fixed';
    this.show(this.frame);
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || takesKey(event)) return;
    const keys = this.keys(),
      act = keys[event.key] ?? keys[event.key.toLowerCase()];
    if (!act) return;
    event.preventDefault();
    act();
  }

  /** State for programs that test the page. */
  publish() {
    const view = this;
    window.pliant = {
      ready: true,
      faults: window.pliant.faults,
      view,
      get frame() {
        return view.frame;
      },
      get drawn() {
        return view.drawnFrame;
      },
      get frames() {
        return view.recording.times.length;
      },
      get colouring() {
        return view.recording.colourings[view.colouring].name;
      },
      show(frame) {
        view.seek(frame);
        view.stage.draw();
      },
      /** Pixel of the canvas at which a vertex of a body is seen. */
      project: (body, vertex) => view.stage.project(view.bodies[body].place(vertex, view.frame)),
      pick: (x, y) => view.stage.pick(x, y),
    };
  }
}
