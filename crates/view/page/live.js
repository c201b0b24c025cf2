// A run that goes on: its newest frame in the picture, its energies under it, its commands at hand.
import { brief } from 'pliant/charts';
import { addPanel, Controls } from 'pliant/controls';
import { Fault } from 'pliant/fault';
import { Grab } from 'pliant/grab';
import { Rolling } from 'pliant/rolling';
import { Link } from 'pliant/link';
import { Numbers } from 'pliant/numbers';
import { by, choices, element, fillHelp, HELP } from 'pliant/panel';
import { View } from 'pliant/view';

/** Simulated seconds a second; `null` is as fast as the run goes. */
const SPEEDS = [0.1, 0.2, 0.5, 1, 2, 5, 10, null];
/** Room around the first picture, in sizes of its box: bodies will move. */
const ROOM = 0.15;
const PLAYING = /^(space|← →|Home|\+ −|L|R)/;
const LIVE_HELP = [
  ['shift and drag', 'pull a vertex'],
  ['D', 'pull with every drag, on, off'],
  ['space', 'pause, continue'],
  ['. →', 'a step'],
  ['R', 'reset'],
  ['B', 'back to the last good state'],
  ['+ −', 'faster, slower'],
  ['M', 'range: so far, now'],
];
const SPEED_UNIT = 'm/s';

export class LiveView extends View {
  constructor(recording, carrier) {
    super({ ...recording, probes: [] });
    this.carrier = carrier;
    this.units = new Map(recording.colourings.map(({ name, unit }) => [name, unit]));
    document.body.classList.add('live');
  }

  async start() {
    this.panel = addPanel();
    await super.start();
    this.#furnish();
    this.grab = new Grab(this);
    this.fault = new Fault(this);
    this.controls = new Controls(this.panel, command => this.link.ask(command));
    const drawn = this.stage.onDrawn;
    this.stage.onDrawn = () => {
      drawn();
      if (this.shown) this.grab.drawn(this.shown.command);
    };
    await new Promise(greeted => {
      this.greeted = greeted;
      this.link = new Link(this.carrier, {
        hello: message => this.#greet(message),
        state: message => this.#state(message),
        controls: message => this.#changed(message),
        frame: frame => this.#frame(frame),
        refused: reply => this.#refused(reply),
        lost: (opened, again) => this.#lost(opened, again),
      });
    });
  }

  /** Controls of the player for a run instead of a recording. */
  #furnish() {
    const on = (id, event, act) => by(id).addEventListener(event, act);
    choices(
      by('speed'),
      SPEEDS.map(speed => (speed === null ? 'as fast as it goes' : `${speed}×`)),
    );
    on('speed', 'change', () => this.#speed());
    by('range').options[0].textContent = 'so far';
    by('range').options[1].textContent = 'now';
    by('play').title = 'pause, continue (space)';
    by('forward').title = 'a step (.)';
    by('fit').addEventListener('click', () => this.#grow(), { capture: true });
    const add = (name, text, place, properties) => {
      place.append(Object.assign(element(name, text), properties));
    };
    add('button', 'reset', by('player'), { id: 'reset', title: 'start again (R)' });
    add('output', '', by('player'), { id: 'pace' });
    add('span', '', by('player'), { id: 'refused', className: 'refusal' });
    by('fit').before(
      Object.assign(element('button', 'pull'), { id: 'grab', title: 'pull vertices with every drag (D)' }),
    );
    on('reset', 'click', () => this.order({ do: 'reset' }));
    on('grab', 'click', () => this.#turnTool());
    fillHelp('Positions are shown to 1e-5 of the body’s box; all numbers come from the run.', [
      ...HELP.slice(0, 4),
      ...LIVE_HELP,
      ...HELP.slice(4).filter(([keys]) => !PLAYING.test(keys)),
    ]);
    const size = this.way.max.distanceTo(this.way.min);
    this.way.expandByScalar(ROOM * size);
    if (this.recording.dimension === 2) this.way.min.z = this.way.max.z = 0;
    this.focus = this.way;
    this.redecorate();
    this.stage.fit(this.way, true);
  }

  /** Grid under all that was seen. */
  #grow() {
    this.way.union(this.boxOf(0));
    this.redecorate();
  }

  #greet(hello) {
    const { measures } = hello;
    this.recording.colourings = [
      { name: 'body', unit: '1' },
      { name: 'speed', unit: SPEED_UNIT, range: [0, 0] },
      ...measures.map(name => ({ name, unit: this.units.get(name) ?? '1', range: [0, 0] })),
    ];
    choices(
      by('colouring'),
      this.recording.colourings.map(colouring => colouring.name),
    );
    this.numbers ??= new Numbers(this.bodies, hello, () => this.measure);
    this.rolling = new Rolling(this.chart);
    this.controls.build(hello);
    this.#showPins(hello.controls);
    this.measure = null;
    this.colouring = 0;
    this.fault.reconnected();
    this.#state(hello.state);
    this.greeted();
  }

  #changed(message) {
    this.controls.take(message);
    this.#showPins(message.controls);
  }

  /** Symbols of pins at the bodies that have one that is on. */
  #showPins(controls) {
    for (const body of this.bodies) {
      const own = controls.filter(({ path }) => path.startsWith(`pin.${body.name}/`)),
        pins = body.objects.find(object => object.userData.role === 'pin');
      if (pins && own.length) pins.visible = own.some(({ value }) => value);
    }
    this.stage.ask();
  }

  #refused({ command, message }) {
    by('refused').textContent = message;
    this.grab.refused(command);
  }

  #state(state) {
    const fresh = this.state === undefined || state.step < this.state.step;
    this.state = state;
    if (fresh) this.numbers.forget();
    this.grabbed = state.grabbed;
    this.playing = !state.paused;
    this.rolling.add(state);
    this.#soon();
  }

  /** Refreshes the page with the next picture of the browser, however many messages come until then. */
  #soon() {
    this.due ??= requestAnimationFrame(() => {
      this.due = null;
      this.#refresh();
    });
  }

  #refresh() {
    const { state } = this;
    by('play').textContent = state.paused ? '▶' : '❚❚';
    by('play').setAttribute('aria-label', state.paused ? 'continue' : 'pause');
    if (document.activeElement !== by('speed')) by('speed').value = nearest(state.speed);
    by('pace').textContent = state.paused ? 'paused' : `${brief(state.pace)} s a second`;
    this.controls.recording.show(state.recording);
    this.fault.show(state);
    this.rolling.show();
    this.showTime();
    if (this.newest) this.#take();
    else this.grab.draw();
  }

  #frame(frame) {
    this.newest = frame;
    this.#soon();
  }

  /** Newest frame into the picture; those between two pictures of the browser are never shown. */
  #take() {
    const frame = this.newest,
      before = this.shown && by('follow').checked && this.centre(0);
    this.newest = null;
    this.shown = frame;
    this.numbers.take(frame);
    const [speed, values] = [this.numbers.speedRange, this.numbers.valueRange];
    this.recording.colourings.forEach((colouring, k) => {
      if (k > 0) colouring.range = (k === 1 ? speed : values) ?? [0, 0];
    });
    if (before) this.stage.move(this.centre(0).sub(before));
    this.show(0);
    this.fault.place();
    this.grab.draw();
  }

  #lost(opened, again) {
    // What is due would show a run that goes on.
    cancelAnimationFrame(this.due);
    this.due = null;
    this.grab.release();
    this.playing = false;
    by('pace').textContent = 'no connection';
    this.fault.disconnected(again, this.state !== undefined || opened);
    this.greeted();
  }

  /** Chosen measure, which the run sends from now on. */
  colourBy(number) {
    // Before the run has said hello, there is nothing to colour by.
    if (!this.numbers) return;
    const measure = number > 1 ? this.recording.colourings[number].name : null;
    if (measure !== this.measure) {
      this.measure = measure;
      this.numbers.forgetValues();
      this.order({ do: 'measure', name: measure });
    }
    super.colourBy(number);
  }

  /** Position of a vertex by its number in the run; null where it is not drawn. */
  placeOf(number) {
    for (const body of this.bodies) {
      const vertex = body.vertices.indexOf(number);
      if (vertex >= 0) return body.place(vertex, 0);
    }
    return null;
  }

  showTime() {
    const { time, step } = this.shown ?? this.state ?? { time: 0, step: 0 };
    by('clock').textContent = `${brief(time)} s · step ${step}`;
  }

  /** Sends a command whose refusal is shown at the player. */
  async order(command) {
    const reply = this.link
      ? await this.link.ask(command)
      : { ok: false, message: 'the run has not answered yet' };
    by('refused').textContent = reply.ok ? '' : reply.message;
    return reply;
  }

  /** Sends a command without waiting for its reply; gives its number. */
  tell(command) {
    return this.link.send(command);
  }

  play(on) {
    // A long step is ended first; the next state says what the run does.
    if (!on) by('pace').textContent = 'pausing after this step';
    this.order({ do: on ? 'continue' : 'pause' });
  }

  forward() {
    this.order({ do: 'step', count: 1 });
  }

  /** A run has no frames to go to. */
  seek() {}

  #speed() {
    this.order({ do: 'speed', value: SPEEDS[by('speed').value] });
  }

  #faster(step) {
    by('speed').value = Math.min(SPEEDS.length - 1, Math.max(0, Number(by('speed').value) + step));
    this.#speed();
  }

  #turnTool() {
    this.grab.tool = !this.grab.tool;
  }

  goBack() {
    this.order({ do: 'go-back' });
  }

  keys() {
    const { Home, End, ArrowLeft, l, ...keys } = super.keys();
    return {
      ...keys,
      '.': () => this.forward(),
      '+': () => this.#faster(1),
      '=': () => this.#faster(1),
      '-': () => this.#faster(-1),
      r: () => this.order({ do: 'reset' }),
      m: () => this.turnRange(),
      d: () => this.#turnTool(),
      b: () => this.goBack(),
    };
  }
}

/** Number of the choice that is nearest to a speed. */
function nearest(speed) {
  if (speed === null) return SPEEDS.length - 1;
  const away = k => Math.abs(Math.log(SPEEDS[k] / speed));
  return SPEEDS.slice(0, -1).reduce((best, _, k) => (away(k) < away(best) ? k : best), 0);
}
