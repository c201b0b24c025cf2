// The editor: the text of a scene next to its run.
'use strict';

const MESHES = /\.(obj|stl|msh|vtu|vtk|inp)$/i;
const FIRST_SCENE = 'cantilever_fem_2d';
/** Parts of the run's page that this one has: recordings are downloaded, and there is one theme. */
const FRAME_STYLE = '#panel details:has(> .recording), #theme { display: none }';
/** Time for which a word about what was done stays [ms]. */
const SHORT = 6000;

class Shell {
  constructor() {
    this.files = new Map();
    this.field = new TomlField(by('field'), { changed: () => this.#edited() });
    this.field.input.setAttribute('aria-label', 'TOML');
    this.engine = new Engine({
      work: work => this.#work(work),
      fault: message => this.#trap(message),
    });
    this.#listen();
    this.#list();
    settings.listeners.push(() => this.#again());
    settings.apply();
    this.#tab('picture');
  }

  #listen() {
    const on = (id, event, act) => by(id).addEventListener(event, act);
    on('run', 'click', () => this.run());
    on('copy', 'click', () => this.copyLink());
    on('add', 'click', () => by('files').click());
    on('files', 'change', () => this.take(by('files').files));
    on('download', 'click', () => this.download());
    on('bits', 'click', () => this.compareBits());
    on('language', 'click', () => settings.turnLanguage());
    on('theme', 'click', () => settings.turnTheme());
    on('shipped', 'change', () => this.openShipped(by('shipped').value));
    on('tab-scene', 'click', () => this.#tab('scene'));
    on('tab-picture', 'click', () => this.#tab('picture'));
    addEventListener('hashchange', () => this.openLink());
    addEventListener('keydown', event => {
      if (event.key !== 'Enter' || !(event.ctrlKey || event.metaKey)) return;
      event.preventDefault();
      this.run();
    });
    const drop = over => event => {
      if (!event.dataTransfer?.types.includes('Files')) return;
      event.preventDefault();
      by('drop').hidden = !over;
    };
    addEventListener('dragenter', drop(true));
    addEventListener('dragover', drop(true));
    on('drop', 'dragleave', drop(false));
    addEventListener('drop', event => {
      drop(false)(event);
      if (event.dataTransfer?.files.length) this.take(event.dataTransfer.files);
    });
  }

  #list() {
    const own = new Option('', '');
    by('shipped').replaceChildren(own, ...pliantScenes.map(({ name, title }) => new Option(title, name)));
    this.own = own;
  }

  /** What depends on language and theme, once more. */
  #again() {
    this.own.textContent = say('ownScene');
    document.title = say('title');
    this.#showFiles();
    this.#showTimes();
    this.#showRefusal();
    const inside = by('page').contentWindow;
    if (settings.theme && inside?.pliant?.view) {
      inside.document.documentElement.dataset.theme = settings.theme;
      inside.pliant.view.redecorate();
    }
  }

  #tab(name) {
    document.body.dataset.tab = name;
    for (const each of ['scene', 'picture']) by(`tab-${each}`).setAttribute('aria-selected', each === name);
  }

  #say(text, bad = false) {
    by('said').textContent = text;
    by('said').classList.toggle('bad', bad);
    clearTimeout(this.silence);
    this.silence = setTimeout(() => (by('said').textContent = ''), SHORT);
  }

  #wait(name) {
    by('wait').textContent = name ? say(name) : '';
    by('wait').classList.remove('bad');
  }

  #edited() {
    by('shipped').value = '';
    this.name = null;
    this.refusal = null;
  }

  /** The scene in the address, or the first one. */
  async openLink() {
    const { scene, shipped } = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
    if (shipped) return this.openShipped(shipped);
    if (!scene) return this.openShipped(FIRST_SCENE);
    if (scene === this.linked) return undefined;
    try {
      this.field.text = await sceneLink.read(scene);
    } catch {
      this.#say(say('badLink'), true);
      return this.openShipped(FIRST_SCENE);
    }
    this.#edited();
    return this.run();
  }

  async openShipped(name) {
    const scene = pliantScenes.find(scene => scene.name === name);
    if (!scene) return;
    by('shipped').value = this.name = name;
    this.field.text = scene.text;
    const held = new URLSearchParams(location.hash.slice(1)).get('shipped');
    if (held !== name) history.replaceState(null, '', `#shipped=${name}`);
    for (const file of scene.files) if (!this.files.has(file)) this.#give(file, await packedData(file));
    await this.run();
  }

  #give(name, bytes) {
    this.files.set(name, bytes);
    this.engine.file(name, bytes);
    this.#showFiles();
  }

  #showFiles() {
    by('given').replaceChildren(
      ...[...this.files].map(([name, bytes]) => {
        const remove = made('button', { title: say('remove') }, '×');
        remove.setAttribute('aria-label', `${say('remove')} ${name}`);
        remove.addEventListener('click', () => {
          this.files.delete(name);
          this.engine.forgetFiles();
          this.files.forEach((kept, name) => this.engine.file(name, kept));
          this.#showFiles();
        });
        return made('li', {}, made('code', {}, name), ` ${Math.ceil(bytes.length / 1000)} kB `, remove);
      }),
    );
  }

  /** Files of the user: a scene, or meshes for it. */
  async take(files) {
    let scene;
    for (const file of files) {
      if (/\.toml$/i.test(file.name)) scene = await file.text();
      else if (MESHES.test(file.name)) this.#give(file.name, new Uint8Array(await file.arrayBuffer()));
      else this.#say(`${file.name} ${say('unknownFile')}`, true);
    }
    by('files').value = '';
    if (scene === undefined) return;
    this.field.text = scene;
    this.#edited();
    await this.run();
  }

  /** Runs the text; of calls that come while a scene is assembled, the last. */
  async run() {
    this.due = true;
    if (this.busy) return;
    this.busy = true;
    while (this.due) {
      this.due = false;
      this.#wait(this.isReady ? 'opening' : 'loading');
      const { html, refusal, fault } = await this.engine.open(this.field.text).catch(fault => ({ fault }));
      this.isReady = true;
      this.refusal = refusal ?? null;
      this.time = null;
      this.#showTimes();
      by('download').disabled = !html;
      if (html) this.#show(html);
      else if (refusal) this.#refused();
      else this.#trap(String(fault));
    }
    this.busy = false;
  }

  #show(html) {
    this.#wait(null);
    this.field.mark(null);
    by('page').hidden = false;
    this.engine.show(by('page'), html, { style: FRAME_STYLE, theme: settings.theme });
  }

  #refused() {
    this.#wait('refused');
    by('page').hidden = true;
    this.#tab('scene');
    this.#showRefusal();
  }

  #showRefusal() {
    const { refusal } = this;
    if (!refusal) return;
    const close = made('button', { title: say('close') }, '×');
    close.addEventListener('click', () => this.field.mark(null));
    const remedies = refusal.remedies.map(({ kind, words }) =>
      made('p', { className: kind }, made('b', {}, say(kind)), ' ', words),
    );
    const whole = made(
      'details',
      {},
      made('summary', {}, say('details')),
      made('pre', {}, refusal.rendered),
    );
    const place = made('small', {}, sayPlace(refusal));
    this.field.mark(refusal, close, place, made('p', {}, refusal.message), ...remedies, whole);
  }

  #trap(message) {
    by('page').hidden = true;
    by('wait').textContent = [say('trap'), message, say('tryAgain')].join('\n');
    by('wait').classList.add('bad');
    by('download').disabled = true;
  }

  #work({ steps, ms }) {
    // A mean over a few reports: single ones are noisy.
    const now = ms / steps;
    this.time = this.time ? 0.7 * this.time + 0.3 * now : now;
    this.#showTimes();
  }

  #showTimes() {
    const parts = [];
    if (this.time) parts.push(say('timeHere').replace('{}', sayTime(this.time / 1000)));
    const native = this.name && window.pliantNative?.times[this.name];
    if (this.time && native) {
      parts.push(say('timeNative').replace('{}', sayTime(native / 1000)));
      const { machine, threads } = pliantNative;
      by('times').title = `${say('nativeHint')} ${machine}, ${threads} ${say('threads')}`;
    } else by('times').title = '';
    by('times').textContent = parts.join(' · ');
    by('bits').hidden = !window.pliantBits?.[this.name];
  }

  /** Takes the first steps of the example scene in a worker of its own. */
  async compareBits() {
    const { length, sha256 } = pliantBits[this.name],
      scene = pliantScenes.find(({ name }) => name === this.name),
      engine = new Engine();
    this.#say(say('comparing'));
    for (const file of scene.files) engine.file(file, this.files.get(file));
    const own = await engine.positions(scene.text, length);
    engine.end();
    const words = own.sha256 === sha256 ? say('bitsEqual') : say('bitsDiffer');
    this.#say(own.sha256 ? words.replace('{}', own.steps).replace('{}', sha256.slice(0, 16)) : own.text);
  }

  async copyLink() {
    this.linked = await sceneLink.write(this.field.text);
    const hash = `#scene=${this.linked}`;
    history.replaceState(null, '', hash);
    const said = this.files.size && /"[^"]*\.(obj|stl|msh|vtu|vtk|inp)"/i.test(this.field.text);
    try {
      await navigator.clipboard.writeText(location.href);
      this.#say(say(said ? 'filesInLink' : 'copied'));
    } catch {
      this.#say(say('copyByHand'));
    }
  }

  async download() {
    const { bytes, message } = await this.engine.download();
    if (!bytes) {
      this.#say(message, true);
      return;
    }
    const address = URL.createObjectURL(new Blob([bytes], { type: 'application/octet-stream' }));
    made('a', { href: address, download: `${this.name ?? 'scene'}.mcap` }).click();
    setTimeout(() => URL.revokeObjectURL(address), SHORT);
  }
}

if (typeof CompressionStream === 'undefined') {
  settings.apply();
  by('wait').textContent = say('old');
} else {
  window.shell = new Shell();
  window.shell.openLink();
}
