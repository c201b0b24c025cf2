// Formulas as MathML from a short notation: letters, numbers and signs stand for themselves, `_{}`, `^{}`,
// `\frac{}{}`, `\sqrt{}`, `\ddot{}`, `\dot{}`, `\text{}` and names of letters such as `\omega` as in TeX.
'use strict';

const LETTERS = {
  alpha: 'α',
  omega: 'ω',
  mu: 'μ',
  lambda: 'λ',
  nu: 'ν',
  phi: 'φ',
  Psi: 'Ψ',
  eps: 'ε',
  theta: 'θ',
  rho: 'ρ',
  kappa: 'κ',
};
const SIGNS = {
  partial: '∂',
  cdot: '⋅',
  le: '≤',
  ge: '≥',
  approx: '≈',
  pm: '±',
  to: '→',
  neq: '≠',
  sum: '∑',
};
const FUNCTIONS = ['cos', 'sin', 'tr', 'det'];
const ACCENTS = { dot: '˙', ddot: '¨' };

const mathElement = (name, ...content) => {
  const made = document.createElementNS('http://www.w3.org/1998/Math/MathML', name);
  made.append(...content);
  return made;
};

class FormulaReader {
  constructor(text) {
    this.parts = text.match(/\\text\{[^}]*\}|\\[A-Za-z]+|\d+(?:\.\d+)?|[A-Za-z]|\S/g) ?? [];
    this.at = 0;
  }

  /** All up to a closing sign or the end. */
  row(end = '}') {
    const row = mathElement('mrow');
    while (this.at < this.parts.length && this.parts[this.at] !== end) row.append(this.#scripted());
    return row;
  }

  /** A part in parentheses or bars, which grow only around fractions. */
  #fenced(open, close) {
    const inner = this.row(close),
      grows = String(inner.querySelector('mfrac') !== null);
    this.at++;
    const fence = (sign, form) => {
      const made = mathElement('mo', sign);
      Object.entries({ form, stretchy: grows, fence: 'true' }).forEach(pair => made.setAttribute(...pair));
      return made;
    };
    return mathElement('mrow', fence(open, 'prefix'), inner, fence(close, 'postfix'));
  }

  #group() {
    if (this.parts[this.at] !== '{') return this.#single();
    this.at++;
    const row = this.row();
    this.at++;
    return row;
  }

  /** One part with what stands below and above it. */
  #scripted() {
    const base = this.#single(),
      scripts = {};
    while (['_', '^'].includes(this.parts[this.at])) scripts[this.parts[this.at++]] = this.#group();
    if (scripts._ && scripts['^']) return mathElement('msubsup', base, scripts._, scripts['^']);
    if (scripts._) return mathElement('msub', base, scripts._);
    return scripts['^'] ? mathElement('msup', base, scripts['^']) : base;
  }

  #single() {
    const part = this.parts[this.at++];
    if (/^\d/.test(part)) return mathElement('mn', part);
    if (/^[A-Za-z]$/.test(part)) return mathElement('mi', part);
    if (part === '(') return this.#fenced('(', ')');
    if (part === '|') return this.#fenced('|', '|');
    if (part.startsWith('\\text{')) return mathElement('mtext', part.slice(6, -1));
    if (part[0] !== '\\') return mathElement('mo', part === '-' ? '−' : part);
    const name = part.slice(1);
    if (LETTERS[name]) return mathElement('mi', LETTERS[name]);
    if (SIGNS[name]) return mathElement('mo', SIGNS[name]);
    if (FUNCTIONS.includes(name)) return mathElement('mi', name);
    if (name === 'frac') return mathElement('mfrac', this.#group(), this.#group());
    if (name === 'sqrt') return mathElement('msqrt', this.#group());
    if (ACCENTS[name]) return accented(this.#group(), ACCENTS[name]);
    throw new Error(`a formula has the unknown name ${part}`);
  }
}

function accented(base, accent) {
  const made = mathElement('mover', base, mathElement('mo', accent));
  made.setAttribute('accent', 'true');
  return made;
}

/** A formula of its own line; its parts, between `\\quad`, go to further lines where there is no room. */
function formula(text) {
  const line = document.createElement('div');
  line.className = 'formula';
  for (const part of text.split('\\quad')) {
    const math = mathElement('math', new FormulaReader(part).row());
    math.setAttribute('displaystyle', 'true');
    line.append(math);
  }
  return line;
}
