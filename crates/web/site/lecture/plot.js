// One chart of lines over an axis, on a canvas, with its legend below it.
'use strict';

/** Okabe and Ito; readable on light and dark. */
const PLOT_COLOURS = ['#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9'];
const PLOT_MARGIN = { left: 58, right: 12, top: 10, bottom: 34 };

/** Round numbers within a range, about `count` of them. */
function roundTicks(low, high, count) {
  const raw = (high - low) / count,
    power = 10 ** Math.floor(Math.log10(raw)),
    step = [1, 2, 5, 10].map(factor => factor * power).find(step => step >= raw);
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high * (1 + 1e-9) + 1e-300; k++)
    ticks.push(k * step);
  return ticks;
}

/** Powers of ten within a range of logarithms, about `count` at most; few have 2 and 5 between them. */
function powerTicks(low, high, count) {
  const every = Math.max(1, Math.ceil((high - low) / count)),
    ticks = [];
  for (let k = Math.floor(low); k <= high; k++) {
    if (k % every === 0) ticks.push(...(high - low < 2 ? [1, 2, 5] : [1]).map(factor => factor * 10 ** k));
  }
  return ticks.filter(tick => Math.log10(tick) >= low - 1e-9 && Math.log10(tick) <= high + 1e-9);
}

/** Axis from values to a length: `{ low, high, log, place(value), ticks }`. */
function plotAxis({ low, high, log = false, ticks: given }, from, to, count) {
  const scale = log ? Math.log10 : value => value;
  const [first, last] = [scale(low), scale(high)];
  const ticks =
    given ??
    (log && last - first >= 1
      ? powerTicks(first, last, count)
      : roundTicks(low, high, count).filter(t => !log || t > 0));
  return { place: value => from + ((scale(value) - first) / (last - first)) * (to - from), ticks, log };
}

class Plot {
  constructor(root) {
    this.canvas = document.createElement('canvas');
    this.canvas.setAttribute('role', 'img');
    this.legend = document.createElement('div');
    this.legend.className = 'plot-legend';
    root.append(this.canvas, this.legend);
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  /**
   * Shows `{ name, x, y, lines, dots }`. Axes are `{ label, low, high, log, ticks }`; missing ends come from
   * the data. Lines are `{ name, points, colour, dashed, faint }`, points `[x, y]`, dots
   * `{ name, points, colour }`.
   */
  show(chart) {
    this.chart = chart;
    this.canvas.setAttribute('aria-label', chart.name);
    const dots = (chart.dots ?? []).map(each => ({ ...each, dot: true })),
      shown = [...chart.lines, ...dots].filter(({ name }) => name);
    const faint = chart.lines.find(line => line.faint);
    if (faint) shown.push({ ...faint, name: say('before') });
    const key = JSON.stringify(
      shown.map(({ name, colour, dashed, faint }) => [name, colour, dashed, faint]),
    );
    if (key !== this.key) this.#describe(shown);
    this.key = key;
    this.draw();
  }

  #describe(shown) {
    this.legend.replaceChildren(
      ...shown.map(({ name, colour, dashed, faint, dot }) => {
        const label = document.createElement('span');
        label.textContent = name;
        label.style.setProperty('--line', PLOT_COLOURS[colour]);
        label.classList.toggle('dashed', Boolean(dashed));
        label.classList.toggle('faint', Boolean(faint));
        label.classList.toggle('dot', Boolean(dot));
        return label;
      }),
    );
  }

  /** Range of an axis: given ends, else those of the data with some room. */
  #range(axis, k) {
    const { lines, dots = [] } = this.chart;
    const usable = value => Number.isFinite(value) && (!axis.log || value > 0);
    let low = Infinity,
      high = -Infinity;
    for (const { points } of [...lines, ...dots]) {
      for (const point of points) {
        if (!usable(point[k])) continue;
        low = Math.min(low, point[k]);
        high = Math.max(high, point[k]);
      }
    }
    if (low > high) [low, high] = axis.log ? [0.1, 1] : [0, 1];
    // A level line is not stretched to its last digits.
    const least = axis.log ? 0 : Math.max(Math.abs(high) * 1e-9, axis.least ?? 0);
    if (high - low <= least) {
      const room = axis.log ? 0 : 0.5 * (least || 1);
      [low, high] = axis.log ? [low / 2, high * 2] : [(low + high) / 2 - room, (low + high) / 2 + room];
    } else if (axis.log) [low, high] = [low / 1.3, high * 1.3];
    else [low, high] = [low - 0.06 * (high - low), high + 0.06 * (high - low)];
    return { low: axis.low ?? low, high: axis.high ?? high, log: axis.log, ticks: axis.ticks };
  }

  draw() {
    const { canvas, chart } = this,
      [w, h] = [canvas.clientWidth, canvas.clientHeight];
    if (!chart || !w || !h) return;
    const ratio = devicePixelRatio;
    [canvas.width, canvas.height] = [w * ratio, h * ratio];
    const pen = canvas.getContext('2d'),
      css = getComputedStyle(canvas),
      colour = name => css.getPropertyValue(name).trim();
    pen.scale(ratio, ratio);
    const m = PLOT_MARGIN,
      box = [m.left, m.top, w - m.left - m.right, h - m.top - m.bottom];
    const x = plotAxis(this.#range(chart.x, 0), m.left, w - m.right, Math.max(3, w / 90)),
      y = plotAxis(this.#range(chart.y, 1), h - m.bottom, m.top, Math.max(3, h / 45));
    pen.font = '11px system-ui, sans-serif';
    this.#grid(pen, x, y, box, { line: colour('--grid'), text: colour('--soft') });
    pen.save();
    pen.beginPath();
    pen.rect(...box);
    pen.clip();
    for (const line of chart.lines) {
      this.#line(pen, x, y, line.points, { ...line, ink: PLOT_COLOURS[line.colour] });
    }
    for (const { points, colour: number } of chart.dots ?? []) {
      for (const [px, py] of points) {
        pen.beginPath();
        pen.arc(x.place(px), y.place(py), 4.5, 0, 7);
        pen.fillStyle = PLOT_COLOURS[number];
        pen.fill();
        pen.lineWidth = 1.5;
        pen.strokeStyle = colour('--paper');
        pen.stroke();
      }
    }
    pen.restore();
  }

  #grid(pen, x, y, [left, top, width, height], { line, text }) {
    const { chart } = this,
      bottom = top + height;
    pen.strokeStyle = line;
    pen.fillStyle = text;
    pen.lineWidth = 1;
    pen.beginPath();
    pen.textAlign = 'center';
    for (const tick of x.ticks) {
      const at = Math.round(x.place(tick)) + 0.5;
      pen.moveTo(at, top);
      pen.lineTo(at, bottom);
      pen.fillText(sayNumber(tick), at, bottom + 14);
    }
    pen.textAlign = 'right';
    for (const tick of y.ticks) {
      const at = Math.round(y.place(tick)) + 0.5;
      pen.moveTo(left, at);
      pen.lineTo(left + width, at);
      pen.fillText(sayNumber(tick), left - 5, at + 4);
    }
    pen.stroke();
    pen.textAlign = 'right';
    pen.fillText(chart.x.label, left + width, bottom + 29);
    pen.strokeRect(left + 0.5, top + 0.5, width - 1, height - 1);
  }

  #line(pen, x, y, points, { ink, dashed, faint }) {
    pen.strokeStyle = ink;
    pen.globalAlpha = faint ? 0.35 : 1;
    pen.lineWidth = dashed ? 1.3 : 1.8;
    pen.setLineDash(dashed ? [5, 4] : []);
    pen.beginPath();
    let down = false;
    for (const [px, py] of points) {
      const good = Number.isFinite(px) && Number.isFinite(py) && (!y.log || py > 0);
      if (good) pen[down ? 'lineTo' : 'moveTo'](x.place(px), Math.max(-1e4, Math.min(1e4, y.place(py))));
      down = good;
    }
    pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }
}
