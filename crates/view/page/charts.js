// One chart under the time line: numbers over time, with a line at the frame that is shown.

/** Okabe and Ito; readable on light and dark. */
const COLOURS = ['#0072b2', '#e69f00', '#009e73', '#cc79a7', '#56b4e9', '#d55e00'];
const MARGIN = { left: 62, right: 8, top: 6, bottom: 6 };

/** A number with few digits. */
export function brief(value) {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-3 || size >= 1e5)
    ? value.toExponential(2)
    : String(Number(value.toPrecision(4)));
}

const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

export class Chart {
  constructor(canvas, legend, times, seek) {
    Object.assign(this, { canvas, legend, times, frame: 0 });
    let held = false;
    const follow = event => {
      if (held) seek(this.frameAt(event.offsetX));
    };
    canvas.addEventListener('pointerdown', event => {
      held = true;
      canvas.setPointerCapture(event.pointerId);
      follow(event);
    });
    canvas.addEventListener('pointermove', follow);
    canvas.addEventListener('pointerup', () => {
      held = false;
    });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  show(chart) {
    this.chart = chart;
    this.legend.replaceChildren(
      ...chart.series.map((series, k) => {
        const label = document.createElement('span');
        label.textContent = series.name;
        label.style.setProperty('--line', COLOURS[k % COLOURS.length]);
        return label;
      }),
    );
    this.draw();
  }

  #inner() {
    return this.canvas.clientWidth - MARGIN.left - MARGIN.right;
  }

  /** Place of a frame on the time axis, as a function: the canvas is measured once. */
  #axis() {
    const { times } = this,
      first = times[0],
      scale = this.#inner() / (times.at(-1) - first || 1);
    return frame => MARGIN.left + (times[frame] - first) * scale;
  }

  /** The frame nearest to a place on the time axis. */
  frameAt(x) {
    const { times } = this,
      part = Math.min(1, Math.max(0, (x - MARGIN.left) / this.#inner()));
    const time = times[0] + part * (times.at(-1) - times[0]);
    return times.reduce((best, t, k) => (Math.abs(t - time) < Math.abs(times[best] - time) ? k : best), 0);
  }

  draw() {
    const { canvas, chart } = this,
      ratio = devicePixelRatio,
      w = canvas.clientWidth,
      h = canvas.clientHeight;
    if (!chart || !w || !this.times.length) return;
    canvas.width = w * ratio;
    canvas.height = h * ratio;
    const pen = canvas.getContext('2d');
    pen.scale(ratio, ratio);
    const values = chart.series.flatMap(series => series.values).filter(value => value !== null);
    let low = Math.min(...values),
      high = Math.max(...values);
    if (!(high > low)) {
      const room = Math.abs(high) * 1e-3 || 1;
      low -= room;
      high += room;
    }
    const x = this.#axis();
    const y = value => MARGIN.top + ((high - value) / (high - low)) * (h - MARGIN.top - MARGIN.bottom);
    pen.strokeStyle = css('--rule');
    pen.strokeRect(MARGIN.left + 0.5, MARGIN.top + 0.5, this.#inner(), h - MARGIN.top - MARGIN.bottom);
    pen.fillStyle = css('--soft');
    pen.font = '11px system-ui, sans-serif';
    pen.textAlign = 'right';
    pen.fillText(brief(high), MARGIN.left - 5, MARGIN.top + 8);
    pen.fillText(chart.unit === '1' ? '' : chart.unit, MARGIN.left - 5, h / 2 + 4);
    pen.fillText(brief(low), MARGIN.left - 5, h - MARGIN.bottom);
    if (low < 0 && high > 0)
      this.#line(
        pen,
        [
          [MARGIN.left, y(0)],
          [w - MARGIN.right, y(0)],
        ],
        css('--rule'),
        1,
      );
    chart.series.forEach((series, k) => {
      const points = series.values.map((value, frame) =>
        value === null ? null : [x(frame), y(value)],
      );
      this.#line(pen, points, COLOURS[k % COLOURS.length], 1.6);
    });
    this.#line(
      pen,
      [
        [x(this.frame), MARGIN.top],
        [x(this.frame), h - MARGIN.bottom],
      ],
      css('--ink'),
      1,
    );
  }

  /** A line that is interrupted where a point is null. */
  #line(pen, points, colour, width) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.beginPath();
    let down = false;
    for (const point of points) {
      if (point) pen[down ? 'lineTo' : 'moveTo'](...point);
      down = point !== null;
    }
    pen.stroke();
  }
}
