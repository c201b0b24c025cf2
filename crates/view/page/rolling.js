// The newest part of a run's energies, in the chart.

import { by } from 'pliant/panel';

/** Points of the chart. */
const MOST = 600;

export class Rolling {
  constructor(chart) {
    Object.assign(this, { chart, times: [], series: new Map() });
    chart.times = this.times;
    chart.chart = null;
    by('chart-box').hidden = false;
  }

  /** A state that is earlier than the last one takes back those after it. */
  add({ time, energy }) {
    while (this.times.length && this.times.at(-1) > time) this.#drop('pop');
    if (this.times.at(-1) === time) this.#drop('pop');
    this.times.push(time);
    for (const [name, value] of Object.entries(energy)) this.#of(name).push(value);
    // A name that is missing now has a gap.
    for (const values of this.series.values()) if (values.length < this.times.length) values.push(null);
    while (this.times.length > MOST) this.#drop('shift');
  }

  #of(name) {
    if (!this.series.has(name)) this.series.set(name, this.times.slice(1).fill(null));
    return this.series.get(name);
  }

  #drop(end) {
    this.times[end]();
    for (const values of this.series.values()) values[end]();
  }

  /** Draws what was added. */
  show() {
    const names = [...this.series.keys()];
    this.chart.frame = this.times.length - 1;
    if (this.chart.chart?.series.length === names.length) {
      this.chart.draw();
      return;
    }
    const series = names.map(name => ({ name, values: this.series.get(name) }));
    this.chart.show({ name: 'energy', unit: 'J', series });
  }
}
