// The panel of a run: its numbers and switches by group, its integrator, and its recording.
import { by, element } from 'pliant/panel';

/** Positions of a slider. */
const NOTCHES = 1000;

/** Position of a value on a slider, and back. */
export function notch({ minimum, maximum, scale }, value) {
  const part =
    scale === 'log'
      ? Math.log(value / minimum) / Math.log(maximum / minimum)
      : (value - minimum) / (maximum - minimum);
  return Math.round(NOTCHES * Math.min(1, Math.max(0, part)));
}
export function valueAt({ minimum, maximum, scale }, place) {
  const part = place / NOTCHES;
  const value =
    scale === 'log' ? minimum * (maximum / minimum) ** part : minimum + (maximum - minimum) * part;
  return Number(value.toPrecision(3));
}

/** Label of a control within its group, whose name need not be said again. */
const short = ({ label, group }) => (label.startsWith(`${group}: `) ? label.slice(group.length + 2) : label);

const input = (type, properties) => Object.assign(document.createElement('input'), { type, ...properties });

/** One row: what it shows is what the run has confirmed, or what the hand is doing. */
class Row {
  constructor(control, ask) {
    Object.assign(this, { control, ask, wanted: undefined, busy: false });
    this.root = element('div', '');
    this.root.className = `control ${control.kind}`;
    this.root.dataset.path = control.path;
    this.refusal = element('div', '');
    this.refusal.className = 'refusal';
    this.refusal.setAttribute('role', 'alert');
  }

  /** Sends a value; of those that come while the run answers, the newest. */
  async set(value) {
    this.wanted = value;
    if (this.busy) return;
    this.busy = true;
    while (this.wanted !== undefined) {
      const next = this.wanted;
      this.wanted = undefined;
      const reply = await this.ask(this.command(next));
      this.refusal.textContent = reply.ok ? '' : reply.message;
      if (reply.ok) this.control.value = next;
    }
    this.busy = false;
    this.show();
  }

  take(control) {
    this.control = control;
    if (!this.busy) this.show();
  }
}

class NumberRow extends Row {
  constructor(control, ask) {
    super(control, ask);
    const label = element('label', ''),
      name = element('span', short(control));
    this.field = input('number', { step: 'any' });
    this.slider = input('range', { min: 0, max: NOTCHES, step: 1 });
    this.slider.setAttribute('aria-label', control.label);
    label.append(name, this.field, element('small', control.unit === '1' ? '' : (control.unit ?? '')));
    this.root.append(label, this.slider, this.refusal);
    this.field.addEventListener('change', () => this.#typed());
    this.slider.addEventListener('input', () => {
      const value = valueAt(this.control, this.slider.valueAsNumber);
      this.field.value = value;
      this.set(value);
    });
    this.show();
  }

  /** Without a number the field shows again what holds. */
  #typed() {
    if (Number.isFinite(this.field.valueAsNumber)) this.set(this.field.valueAsNumber);
    else this.show();
  }

  command(value) {
    return { do: 'set', path: this.control.path, value };
  }

  show() {
    this.field.value = Number(this.control.value.toPrecision(6));
    this.slider.value = notch(this.control, this.control.value);
  }
}

class ToggleRow extends Row {
  constructor(control, ask) {
    super(control, ask);
    const label = element('label', '');
    this.box = input('checkbox', {});
    this.box.dataset.space = '';
    label.append(this.box, element('span', short(control)));
    this.root.append(label, this.refusal);
    this.box.addEventListener('change', () => this.set(this.box.checked));
    this.show();
  }

  command(on) {
    const { path } = this.control;
    return path.startsWith('pin.')
      ? { do: 'pin', name: path.slice('pin.'.length), on }
      : { do: 'set', path, value: on };
  }

  show() {
    this.box.checked = this.control.value;
  }
}

class ChoiceRow extends Row {
  constructor(control, ask) {
    super(control, ask);
    const label = element('label', '');
    this.select = document.createElement('select');
    for (const name of control.choices) this.select.append(new Option(name, name));
    label.append(element('span', short(control)), this.select);
    this.root.append(label, this.refusal);
    this.select.addEventListener('change', () => this.set(this.select.value));
    this.show();
  }

  command(name) {
    return { do: 'integrator', name };
  }

  show() {
    this.select.value = this.control.value;
  }
}

const ROWS = { number: NumberRow, toggle: ToggleRow, choice: ChoiceRow };

/** The name of a new file, or the one that is written to. */
class RecordingRow {
  constructor(ask) {
    this.ask = ask;
    this.root = element('div', '');
    this.root.className = 'control recording';
    this.path = input('text', { value: 'run.mcap', spellcheck: false });
    this.path.setAttribute('aria-label', 'file of the recording');
    this.button = element('button', 'record');
    this.refusal = element('div', '');
    this.refusal.className = 'refusal';
    this.root.append(this.path, this.button, this.refusal);
    this.button.addEventListener('click', () => this.turn());
  }

  async turn() {
    const reply = await this.ask(
      this.file ? { do: 'stop-recording' } : { do: 'record', path: this.path.value },
    );
    this.refusal.textContent = reply.ok ? '' : reply.message;
  }

  show(file) {
    this.file = file;
    this.button.textContent = file ? 'stop' : 'record';
    this.button.classList.toggle('on', Boolean(file));
    this.path.disabled = Boolean(file);
    if (file) this.path.value = file;
  }
}

export class Controls {
  constructor(panel, ask) {
    Object.assign(this, { panel, ask, rows: new Map() });
    this.recording = new RecordingRow(ask);
  }

  /** Rows for what the run says can be changed. */
  build({ controls, integrators, integrator }) {
    this.integrators = integrators;
    this.rows.clear();
    const groups = new Map();
    for (const control of [...controls, this.#integrator(integrator)]) {
      const row = new ROWS[control.kind](control, this.ask);
      this.rows.set(control.path, row);
      groups.set(control.group, [...(groups.get(control.group) ?? []), row.root]);
    }
    groups.set('recording', [this.recording.root]);
    this.panel.replaceChildren(...[...groups].map(([name, rows]) => group(name, rows)));
  }

  #integrator(value) {
    const group = 'time';
    return {
      path: 'integrator',
      label: 'integrator',
      kind: 'choice',
      choices: this.integrators,
      value,
      group,
    };
  }

  take({ controls, integrator }) {
    for (const control of [...controls, this.#integrator(integrator)]) {
      this.rows.get(control.path)?.take(control);
    }
  }
}

function group(name, rows) {
  const made = document.createElement('details');
  made.open = true;
  made.append(element('summary', name), ...rows);
  return made;
}

/** The panel beside the picture, which keeps its place. */
export function addPanel() {
  const stage = by('stage'),
    middle = element('div', ''),
    panel = element('aside', '');
  middle.id = 'middle';
  panel.id = 'panel';
  panel.setAttribute('aria-label', 'controls of the run');
  stage.replaceWith(middle);
  middle.append(stage, panel);
  return panel;
}
