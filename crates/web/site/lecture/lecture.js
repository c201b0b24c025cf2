// A page of the lecture: text, formulas and code of one step, its scene live, and charts that follow sliders.
'use strict';

/** The picture alone: player, sliders and charts are those of this page. */
const FRAME_STYLE = `header, footer, #panel, #legend, #notice { display: none !important }
#scale { left: auto; right: 10px }`;
const SPEEDS = [0.05, 0.1, 0.2, 0.25, 0.5, 1, 2, 5, null];
const NOTCHES = 1000;
/** Samples above which every second one is dropped. */
const MOST = 4000;
/** Samples that a run needs to be shown faintly behind the next one. */
const SHOWN_BEHIND = 12;
/** Time without changes before a limit is computed or a link is written [ms]. */
const CALM = 200;
/** The limit in the message that refuses a larger step. */
const ALLOWED = /allows at most ([-+.\de]+) (s|ms|us|µs|ns)\b/;
const UNITS = { s: 1, ms: 1e-3, us: 1e-6, µs: 1e-6, ns: 1e-9 };

/** Text in which `code` is marked. */
function rich(text) {
  return text.split('`').map((part, k) => (k % 2 ? made('code', {}, part) : part));
}

/** Step, time and positions of a frame of the run, as the page of the run reads it. */
function readPositions(buffer) {
  const view = new DataView(buffer),
    [vertices, dimension] = [view.getUint32(24, true), view.getUint32(28, true)];
  return {
    step: Number(view.getBigUint64(8, true)),
    time: view.getFloat64(16, true),
    dimension,
    positions: new Float32Array(buffer, 40, vertices * dimension),
  };
}

/** What a run has told so far. */
class Samples {
  constructor(session) {
    Object.assign(this, { states: [], frames: [], first: null, session, limit: null, before: null });
    this.reached = { states: -1, frames: -1 };
  }

  get time() {
    return Math.max(this.states.at(-1)?.time ?? 0, this.frames.at(-1)?.time ?? 0);
  }

  add(list, sample) {
    const own = this[list];
    if (!sample) return;
    // What went back, or came late from before a reset, takes back what is later.
    while (own.length && own.at(-1).time >= sample.time) own.pop();
    own.push(sample);
    if (own.length > MOST) this[list] = own.filter((_, k) => k % 2 === 0);
  }

  /** The next run's samples, with these behind them. */
  next(first = null) {
    const next = new Samples(this.session);
    next.first = first;
    const isLong = this.states.length >= SHOWN_BEHIND || this.frames.length >= SHOWN_BEHIND;
    next.before = isLong ? { states: this.states, frames: this.frames } : this.before;
    next.limit = this.limit;
    return next;
  }
}

class Slider {
  constructor(page, spec) {
    Object.assign(this, { page, spec });
    const whole = spec.step === 1;
    this.output = made('output', {});
    this.range = made('input', {
      type: 'range',
      min: whole ? spec.min : 0,
      max: whole ? spec.max : NOTCHES,
      step: 1,
    });
    this.mark = made('span', { className: 'limit', hidden: true });
    const name = page.text(made('span', {}), spec.name);
    this.root = made(
      'div',
      { className: 'slider' },
      made('label', {}, made('span', { className: 'row' }, name, this.output), this.range),
      this.mark,
    );
    this.root.dataset.key = spec.key;
    this.root.classList.toggle('limited', page.step.limit?.slider === spec.key);
    this.range.addEventListener('input', () => page.change({ [spec.key]: this.value() }));
  }

  part(value) {
    const { min, max, log } = this.spec;
    return log ? Math.log(value / min) / Math.log(max / min) : (value - min) / (max - min);
  }

  value() {
    const { min, max, log, whole } = this.spec,
      part = (this.range.valueAsNumber - this.range.min) / (this.range.max - this.range.min),
      value = log ? min * (max / min) ** part : min + (max - min) * part;
    return whole ? Math.round(value) : Number(value.toPrecision(3));
  }

  show(values, limit) {
    const { key, unit, when, step } = this.spec,
      value = values[key];
    this.root.hidden = when ? !when(values) : false;
    this.range.value = step === 1 ? value : Math.round(NOTCHES * Math.min(1, Math.max(0, this.part(value))));
    this.output.textContent = unit === 's' ? sayTime(value) : `${sayNumber(value)} ${unit}`;
    const part = limit?.value ? this.part(limit.value) : NaN;
    this.mark.hidden = !(part > 0 && part < 1);
    this.root.classList.toggle('above', limit?.binds === true && value > limit.value);
    if (this.mark.hidden) return;
    this.mark.style.setProperty('--at', part);
    this.mark.textContent = `${say(limit.name)} ${sayTime(limit.value)}`;
  }
}

class LecturePage {
  constructor(number) {
    Object.assign(this, { number, step: STEPS[number - 1], texts: [], run: new Samples(new Map()) });
    this.values = { ...this.step.values };
    this.speed = this.step.speed;
    this.#build();
    this.engine = new Engine({
      text: message => this.#take(message),
      frame: bytes => this.#frame(bytes),
      work: work => this.#work(work),
      fault: message => this.#tell(`${say('trap')}\n${message}`, true),
    });
    settings.listeners.push(() => this.#again());
    settings.apply();
    this.#changed();
    this.restart();
  }

  /** Keeps the text of an element in the chosen language. */
  text(element, text) {
    this.texts.push([element, text]);
    return element;
  }

  #section(name, title, ...content) {
    return made('section', { className: name }, this.text(made('h2', {}), title), ...content);
  }

  #build() {
    const { step } = this;
    this.frame = made('iframe', { title: 'pliant' });
    this.notice = made('div', { className: 'notice', hidden: true });
    this.notice.setAttribute('role', 'alert');
    this.toml = made('pre', { className: 'toml' });
    this.theirs = made('pre', {});
    this.formulas = made('div', {});
    this.editor = made('a', { target: '_blank', rel: 'noopener' });
    this.numbers = made('dl', {});
    this.sliders = step.sliders.map(spec => new Slider(this, spec));
    this.figures = step.charts.map(() => {
      const caption = made('figcaption', {}),
        root = made('figure', {}, caption);
      return { root, caption, plot: new Plot(root) };
    });
    const live = made(
      'section',
      { className: 'live' },
      made('div', { className: 'stage' }, this.frame, this.notice),
      this.#player(),
      made(
        'div',
        { className: 'controls' },
        ...(step.choices ?? []).map(choice => this.#choice(choice)),
        ...this.sliders.map(slider => slider.root),
      ),
    );
    const charts = made(
      'section',
      { className: 'charts' },
      ...this.figures.map(({ root }) => root),
      this.numbers,
    );
    by('content').append(
      made(
        'div',
        { className: 'lead' },
        this.text(
          made('h1', {}),
          [0, 1].map(k => `${this.number} ${step.title[k]}`),
        ),
        this.text(made('p', {}), step.lead),
      ),
      this.#section('formulas', 'formula', this.formulas),
      made('div', { className: 'run' }, live, charts),
      this.#section('tries', 'tries', made('ul', {}, ...step.tries.map(each => this.#try(each)))),
      this.#section('theirs', 'theirs', this.theirs),
      this.#section(
        'ours',
        'ours',
        this.text(made('p', {}), step.oursNote),
        this.toml,
        this.text(this.editor, 'openInEditor'),
      ),
      this.#ends(),
    );
    this.#tabs();
  }

  /** The pages before and after this one. */
  #ends() {
    const link = (number, name) => {
      if (number < 1 || number > STEPS.length) return made('span', {});
      const title = [0, 1].map(
        k => `${TEXTS[name][k]}${TEXTS.colon[k]}${number} ${STEPS[number - 1].title[k]}`,
      );
      return this.text(made('a', { href: `${number}.html` }), title);
    };
    return made(
      'div',
      { className: 'ends' },
      link(this.number - 1, 'previous'),
      link(this.number + 1, 'next'),
    );
  }

  #tabs() {
    by('steps').append(
      ...STEPS.map((step, k) => {
        const link = made('a', { href: `${k + 1}.html` }, String(k + 1));
        if (k + 1 === this.number) link.setAttribute('aria-current', 'page');
        this.texts.push([link, [0, 1].map(language => step.title[language]), 'title']);
        return link;
      }),
    );
  }

  #player() {
    const button = (name, act, id) => {
      const each = this.text(made('button', { id }), name);
      each.addEventListener('click', act);
      return each;
    };
    this.playButton = button('pause', () => this.play(!this.playing), 'play');
    this.speeds = made('select', { id: 'speed' });
    this.speeds.addEventListener('change', () => {
      this.speed = SPEEDS[this.speeds.value];
      this.engine.ask({ do: 'speed', value: this.speed });
    });
    this.clock = made('output', { id: 'clock' });
    this.time = made('span', { id: 'time-of-step', title: '' });
    this.hinted = made('span', {});
    return made(
      'div',
      { className: 'player' },
      this.playButton,
      button('oneStep', () => this.engine.ask({ do: 'step', count: 1 }), 'one-step'),
      button('reset', () => this.#reset(), 'reset'),
      made('label', {}, this.text(made('span', {}), 'speed'), ' ', this.speeds),
      this.clock,
      made('div', { className: 'below' }, this.hinted, this.time),
    );
  }

  #choice(choice) {
    const select = made('select', {}),
      root = made('label', { className: 'choice' }, this.text(made('span', {}), choice.name), select);
    for (const [value, name] of choice.options) select.append(this.text(made('option', { value }), name));
    select.addEventListener('change', () => {
      const [value] = choice.options[select.selectedIndex];
      this.change({ [choice.key]: value });
    });
    root.dataset.key = choice.key;
    (this.choices ??= []).push({ choice, select, root });
    return root;
  }

  #try({ text, set }) {
    const item = made('li', {});
    if (!set) return this.text(item, text);
    const button = this.text(made('button', {}), text);
    button.addEventListener('click', () => {
      this.change(set);
      this.frame.scrollIntoView({ block: 'nearest', behavior: 'smooth' });
    });
    item.append(button);
    return item;
  }

  /** Texts once more, after a change of language or theme. */
  #again() {
    for (const [element, text, property] of this.texts) {
      if (property) element[property] = say(text);
      else element.replaceChildren(...rich(say(text)));
    }
    document.title = `${say(this.step.title)} · pliant`;
    this.theirs.textContent = this.step.theirs(say);
    const words = text => `\\text{${say(text)}}`;
    this.formulas.replaceChildren(
      ...this.step.formulas.map(text => formula(typeof text === 'function' ? text(words) : text)),
    );
    this.speeds.replaceChildren(
      ...SPEEDS.map((speed, k) => new Option(speed === null ? say('asFast') : `${speed}×`, k)),
    );
    this.speeds.value = SPEEDS.indexOf(this.speed);
    this.#refresh();
    const inside = this.frame.contentWindow;
    if (settings.theme && inside?.pliant?.view) {
      inside.document.documentElement.dataset.theme = settings.theme;
      inside.pliant.view.redecorate();
    }
  }

  /** New values: set in the run where it goes on and can take them, else the scene is opened again. */
  change(set) {
    const old = this.values;
    this.values = { ...old, ...set };
    const changed = Object.keys(this.values).filter(key => this.values[key] !== old[key]);
    this.#changed();
    const path = changed.length === 1 && this.#path(changed[0]);
    if (path && this.isOpen && !this.busy && !this.ended) this.#set(path, this.values[changed[0]]);
    else this.restart();
  }

  #path(key) {
    const path = this.step.sliders.find(slider => slider.key === key)?.path;
    return typeof path === 'function' ? path(this.values) : path;
  }

  /** Sets a value in the run; of those that come while it answers, the newest. */
  async #set(path, value) {
    this.wanted = { path, value };
    if (this.setting) return;
    this.setting = true;
    while (this.wanted) {
      const next = this.wanted;
      this.wanted = null;
      const reply = await this.engine.ask({ do: 'set', ...next });
      // A scene that is opened meanwhile has the value.
      if (this.busy) this.wanted = null;
      else if (reply.ok) this.#tell(null);
      else this.#tell(reply.message, true);
    }
    this.setting = false;
  }

  /** Opens the scene; of calls that come meanwhile, the last. */
  async restart() {
    this.due = true;
    if (this.busy) return;
    this.busy = true;
    while (this.due) {
      this.due = false;
      if (!this.shape) this.#tell(say('loading'));
      await this.#open({ ...this.values });
    }
    this.busy = false;
  }

  async #open(values) {
    const { step } = this,
      before = [{ do: 'speed', value: this.speed }, { do: 'pause' }];
    const { html, refusal, fault } = await this.engine
      .open(step.scene(values), before)
      .catch(fault => ({ fault }));
    this.run = this.run.next();
    // A run of something else is no comparison.
    if (this.of && step.kind?.(values) !== step.kind?.(this.of)) this.run.before = null;
    [this.of, this.ended, this.isOpen, this.failed] = [values, false, Boolean(html), false];
    if (!html) {
      this.#refused(refusal, fault);
      return;
    }
    this.#tell(null);
    const shape = step.shape(values);
    if (shape === this.shape) this.engine.greetAgain();
    else this.engine.show(this.frame, html, { style: FRAME_STYLE, theme: settings.theme });
    this.shape = shape;
  }

  #refused(refusal, fault) {
    this.playing = false;
    if (!refusal) {
      this.#tell(`${say('trap')}\n${fault}`, true);
      this.shape = undefined;
      return;
    }
    const remedies = refusal.remedies.map(({ kind, words }) => say(kind) + say('colon') + words);
    const place = sayPlace(refusal),
      message = place ? place + say('colon') + refusal.message : refusal.message;
    this.#tell([say('refused') + say('english'), message, ...remedies].join('\n'), true);
    this.#soon();
  }

  #tell(text, bad = false) {
    this.notice.hidden = !text;
    this.notice.textContent = text ?? '';
    this.notice.classList.toggle('bad', bad);
  }

  #take(message) {
    if (message.type === 'hello') this.#state(message.state);
    else if (message.type === 'state') this.#state(message);
  }

  /** A run that goes back has been reset. States and frames come in turns, each in its order. */
  #reach(list, step) {
    if (step < this.run.reached[list]) {
      this.run = this.run.next(this.run.first);
      this.ended = false;
    }
    this.run.reached[list] = step;
  }

  #state(state) {
    if (!this.of) return;
    this.#reach('states', state.step);
    this.playing = !state.paused;
    this.run.add('states', this.step.state(state, this.of, this.run));
    if (state.fault && !this.failed)
      this.#tell(`${say('failed')}${say('english')}\n${state.fault.message}`, true);
    else if (!state.fault && this.failed) this.#tell(null);
    this.failed = Boolean(state.fault);
    if (!this.ended && state.time >= this.step.end(this.of)) {
      this.ended = true;
      this.engine.tell({ do: 'pause' });
      this.step.ended?.(this.run, this.of);
    }
    this.#soon();
  }

  #frame(bytes) {
    if (!this.of) return;
    const frame = readPositions(bytes);
    if (!this.run.first) this.#begin(frame);
    this.run.add('frames', this.step.frame(frame, this.of, this.run));
    this.#soon();
  }

  /** The scene was opened paused, so that its first frame is that of the start. */
  async #begin({ positions, dimension }) {
    const { run } = this;
    run.first = positions.slice();
    while (!this.frame.contentWindow?.pliant?.ready) await new Promise(go => setTimeout(go, 30));
    if (run !== this.run) return;
    const { view } = this.frame.contentWindow.pliant;
    this.#look(view);
    // In the plane a drag pulls; in space it turns the picture.
    view.grab.tool = dimension === 2;
    this.hint = dimension === 2 ? 'pullHint' : 'turnHint';
    if (!this.step.paused) this.play(true);
  }

  /** The part of space that the motion needs, once for each page of the run, and again in another width. */
  #look(view) {
    if (this.looked === view) return;
    this.looked = view;
    if (this.step.view) {
      const [low, high] = this.step.view(this.of);
      view.way.min.set(...low);
      view.way.max.set(...high);
      view.focus = view.way;
      view.redecorate();
    }
    view.stage.fit(view.way, true);
    this.sizes?.disconnect();
    let width = this.frame.clientWidth;
    this.sizes = new ResizeObserver(() => {
      if (width === this.frame.clientWidth) return;
      width = this.frame.clientWidth;
      // The page inside has to see its size first.
      setTimeout(() => view.stage.fit(view.way, false), CALM);
    });
    this.sizes.observe(this.frame);
  }

  #work({ steps, ms }) {
    this.time.textContent = say('timeHere').replace('{}', sayTime(ms / steps / 1000));
    this.time.title = say('limitsHint');
  }

  #soon() {
    this.drawn ??= requestAnimationFrame(() => {
      this.drawn = null;
      this.#refresh();
    });
  }

  async #reset() {
    await this.engine.ask({ do: 'reset' });
    if (!this.step.paused) this.play(true);
  }

  play(on) {
    this.engine.ask({ do: on ? 'continue' : 'pause' });
  }

  /** What depends on the values: scene, sliders, link, limit. */
  #changed() {
    showToml(this.toml, this.step.scene(this.values).trimEnd(), this.step.scene(this.step.values).trimEnd());
    this.#refresh();
    clearTimeout(this.calm);
    this.calm = setTimeout(async () => {
      this.editor.href = `../index.html#scene=${await sceneLink.write(this.step.scene(this.values))}`;
      await this.#probe();
    }, CALM);
  }

  /** The largest stable step: a scene with a far larger one is refused by a message that names it. */
  async #probe() {
    const scene = this.step.limit?.scene(this.values) ?? null;
    if (scene === this.probed) return;
    this.probed = scene;
    await this.engine.loaded;
    this.prober ??= new Engine();
    const { refusal } = scene ? await this.prober.open(scene) : {};
    if (this.probed !== scene) return;
    const found = ALLOWED.exec(refusal?.message ?? '');
    this.run.limit = found ? Number(found[1]) * UNITS[found[2]] : null;
    this.#refresh();
  }

  #refresh() {
    const { run, step, values } = this,
      name = step.limit?.name ?? 'limit',
      limit = { value: run.limit, name, binds: name === 'limit' };
    for (const slider of this.sliders)
      slider.show(values, slider.spec.key === step.limit?.slider ? limit : null);
    for (const { choice, select, root } of this.choices ?? []) {
      root.hidden = choice.when ? !choice.when(values) : false;
      select.selectedIndex = choice.options.findIndex(([value]) => value === values[choice.key]);
    }
    this.playButton.textContent = say(this.playing ? 'pause' : 'play');
    this.clock.textContent = `${run.time.toFixed(2)} s`;
    this.hinted.textContent = this.hint ? say(this.hint) : '';
    this.figures.forEach(({ root, caption, plot }, k) => {
      const chart = step.charts[k](run, values);
      root.hidden = !chart;
      if (!chart) return;
      caption.textContent = chart.name;
      plot.show(chart);
    });
    this.numbers.replaceChildren(
      ...step
        .numbers(run, values)
        .flatMap(([term, number]) => [
          made('dt', {}, Array.isArray(term) || TEXTS[term] ? say(term) : term),
          made('dd', {}, number),
        ]),
    );
  }
}

/** The list of steps. */
function showContents() {
  const texts = [];
  const text = (element, pair) => {
    texts.push([element, pair]);
    return element;
  };
  by('content').classList.add('contents');
  by('content').append(
    text(made('h1', {}), ['The lecture as an instrument', '交互式课程演示']),
    text(made('p', {}), [
      'The lecture “Spatial and Temporal Discretization” builds a simulator of deformable bodies in nine ' +
        'steps. Each page has the formula, the core of the lecture’s program in our words, the same scene ' +
        'in pliant, and the run next to it: drag a slider, and the motion and the charts follow.',
      '课程《空间与时间离散》用九步搭建一个可变形体仿真器。每一页都有公式、课程程序的要点、pliant 中的同一场景，以及旁边正在运行的仿真：拖动滑块，运动和图表随之改变。',
    ]),
    made(
      'ol',
      {},
      ...STEPS.map(({ title, lead }, k) =>
        made('li', {}, text(made('a', { href: `${k + 1}.html` }), title), text(made('p', {}), lead)),
      ),
    ),
    text(made('p', { className: 'small' }), 'numbers'),
    text(made('p', { className: 'small' }), 'limitsHint'),
  );
  settings.listeners.push(() => {
    for (const [element, pair] of texts) element.replaceChildren(...rich(say(pair)));
    document.title = `${say('lecture')} · pliant`;
  });
  settings.apply();
}

by('language').addEventListener('click', () => settings.turnLanguage());
by('theme').addEventListener('click', () => settings.turnTheme());
const number = Number(document.body.dataset.step);
if (number === 0) showContents();
else window.lecturePage = new LecturePage(number);
