// A field for the text of a scene: line numbers, colours, and the place of a mistake.
'use strict';

const TOML = [
  ['comment', /#.*/y],
  ['table', /^\s*\[\[?[^\]]*\]\]?/y],
  ['text', /"(?:[^"\\\n]|\\.)*"|'[^'\n]*'/y],
  ['key', /[A-Za-z_][\w-]*(?=[\w.\s-]*=)|[A-Za-z_][\w-]*(?=\.[\w.\s-]*=)/y],
  ['number', /[+-]?\b\d[\d_]*(?:\.\d+)?(?:[eE][+-]?\d+)?\b|\b(?:true|false)\b/y],
];

/** Coloured parts of a line. */
function colouredToml(line) {
  const parts = document.createDocumentFragment();
  let plain = '';
  const flush = () => {
    if (plain) parts.append(plain);
    plain = '';
  };
  for (let at = 0; at < line.length;) {
    const found = TOML.map(([kind, pattern]) => {
      pattern.lastIndex = at;
      return [kind, pattern.exec(line)?.[0]];
    }).find(([, text]) => text);
    if (!found) {
      plain += line[at++];
      continue;
    }
    flush();
    const part = document.createElement('span');
    [part.className, part.textContent] = [`toml-${found[0]}`, found[1]];
    parts.append(part);
    at += found[1].length;
  }
  flush();
  return parts;
}

/** Text of a scene that is only shown; lines that `before` does not have are marked. */
function showToml(place, text, before = text) {
  const old = new Set(before.split('\n'));
  place.replaceChildren(
    ...text.split('\n').map(line => {
      const row = document.createElement('div');
      row.className = 'toml-line';
      row.classList.toggle('changed', !old.has(line));
      row.append(colouredToml(line), '\n');
      return row;
    }),
  );
}

class TomlField {
  constructor(root, { changed }) {
    Object.assign(this, { root, changed, mistake: null });
    root.classList.add('toml-field');
    [this.numbers, this.colours] = ['numbers', 'colours'].map(name => {
      const made = document.createElement('div');
      made.className = name;
      made.setAttribute('aria-hidden', 'true');
      return made;
    });
    this.input = document.createElement('textarea');
    Object.assign(this.input, {
      spellcheck: false,
      wrap: 'off',
      autocapitalize: 'off',
      autocomplete: 'off',
    });
    this.note = document.createElement('div');
    this.note.className = 'mistake';
    this.note.hidden = true;
    this.note.setAttribute('role', 'alert');
    root.append(this.numbers, this.colours, this.input, this.note);
    this.input.addEventListener('input', () => {
      this.mark(null);
      this.changed();
    });
    this.input.addEventListener('scroll', () => this.#follow());
  }

  get text() {
    return this.input.value;
  }

  set text(text) {
    this.input.value = text;
    this.input.scrollTop = this.input.scrollLeft = 0;
    this.mark(null);
  }

  /** Shows a mistake at its line: `{ line, column }`, and what is said of it. */
  mark(mistake, ...said) {
    this.mistake = mistake;
    this.note.hidden = mistake === null;
    this.note.replaceChildren(...said);
    this.#draw();
    if (mistake?.line) {
      const high = this.#lineHeight(),
        top = (mistake.line - 1) * high;
      const { scrollTop, clientHeight } = this.input;
      if (top < scrollTop || top > scrollTop + 0.5 * clientHeight) this.input.scrollTop = top - 3 * high;
    }
    this.#follow();
  }

  #lineHeight() {
    return parseFloat(getComputedStyle(this.input).lineHeight);
  }

  #draw() {
    const lines = this.text.split('\n'),
      wrong = (this.mistake?.line ?? 0) - 1;
    const row = (content, k) => {
      const made = document.createElement('div');
      made.classList.toggle('wrong', k === wrong);
      made.append(content, '\n');
      return made;
    };
    this.numbers.replaceChildren(...lines.map((_, k) => row(String(k + 1), k)));
    this.colours.replaceChildren(...lines.map((line, k) => row(colouredToml(line), k)));
  }

  /** Numbers, colours and the note go with the text. */
  #follow() {
    const { scrollTop, scrollLeft } = this.input;
    this.numbers.style.transform = `translateY(${-scrollTop}px)`;
    this.colours.style.transform = `translate(${-scrollLeft}px, ${-scrollTop}px)`;
    const line = this.mistake?.line;
    this.note.classList.toggle('below', !line);
    this.note.style.top = line ? `${8 + line * this.#lineHeight() - scrollTop}px` : '';
  }
}
