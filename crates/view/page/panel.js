// Legend, help, theme and the choices of the header.
import { brief } from 'pliant/charts';

export const by = id => document.getElementById(id);

export const HELP = [
  ['drag', 'turn (in the plane: move)'],
  ['right button, two fingers', 'move'],
  ['wheel, pinch', 'closer, farther'],
  ['click', 'numbers of a vertex and its element'],
  ['space', 'play, pause'],
  ['← →', 'a frame back, on'],
  ['Home, End', 'first, last frame'],
  ['+ −', 'faster, slower'],
  ['L', 'loop'],
  ['F', 'fit'],
  ['O', 'follow the bodies'],
  ['E', 'edges'],
  ['G', 'grid'],
  ['C', 'next colouring'],
  ['R', 'range: all frames, this frame'],
  ['T', 'light, dark'],
  ['? H', 'this help'],
  ['Esc', 'close'],
];

export const element = (name, text) => {
  const made = document.createElement(name);
  made.textContent = text;
  return made;
};

/** Fills a list of terms. */
export function terms(list, rows) {
  list.replaceChildren(...rows.flatMap(([term, text]) => [element('dt', term), element('dd', text)]));
}

export function fillHelp(precision, rows = HELP) {
  terms(by('help-rows'), rows);
  by('precision').textContent = precision;
}

/** Choices of a select. */
export function choices(select, names) {
  select.replaceChildren(
    ...names.map((name, k) => {
      const option = element('option', name);
      option.value = k;
      return option;
    }),
  );
}

export function paintBar(map) {
  const pen = by('legend-bar').getContext('2d'),
    picture = pen.createImageData(256, 1);
  for (let k = 0; k < 256; k++) picture.data.set([map[3 * k], map[3 * k + 1], map[3 * k + 2], 255], 4 * k);
  pen.putImageData(picture, 0, 0);
}

/** Colours of bodies, or the ends of a range in its unit. */
export function showLegend(colouring, ends, bodies) {
  const legend = by('legend'),
    coloured = colouring.range !== undefined;
  legend.hidden = false;
  legend.querySelectorAll('.body').forEach(row => row.remove());
  by('legend-bar').hidden = by('legend-ends').hidden = !coloured;
  const unit = colouring.unit === '1' ? '' : ` [${colouring.unit}]`;
  by('legend-name').textContent = coloured ? colouring.name + unit : '';
  if (coloured) {
    by('legend-low').textContent = brief(ends[0]);
    by('legend-high').textContent = brief(ends[1]);
    return;
  }
  for (const body of bodies.slice(0, 12)) {
    const row = element('div', ''),
      swatch = document.createElement('i');
    row.className = 'body';
    swatch.style.background = `rgb(${body.colour.join(',')})`;
    row.append(swatch, element('span', body.name));
    legend.append(row);
  }
}

/** Turns the theme over; without a word of the user it is that of the system. */
export function turnTheme() {
  const root = document.documentElement,
    dark = matchMedia('(prefers-color-scheme: dark)').matches;
  const now = root.dataset.theme ?? (dark ? 'dark' : 'light');
  root.dataset.theme = now === 'dark' ? 'light' : 'dark';
}

/** Whether a key belongs to the field that has the focus: text is typed, a choice is chosen. */
export function takesKey({ target, key }) {
  const typed = target.tagName === 'INPUT' && ['text', 'number'].includes(target.type);
  return typed || target.tagName === 'SELECT' || (key === ' ' && target.dataset?.space !== undefined);
}
