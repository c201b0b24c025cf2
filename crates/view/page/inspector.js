// The inspector: a click tells the numbers of a vertex and of its element.
import { brief } from 'pliant/charts';
import { by, terms } from 'pliant/panel';

const five = values => values.map(value => Number(value.toPrecision(5))).join(', ');

export class Inspector {
  constructor(view) {
    Object.assign(this, { view, chosen: null });
    this.mark = view.stage.mark('mark', '', () => this.place());
    by('inspector-close').addEventListener('click', () => this.close());
    let start = null;
    const { canvas } = view.stage;
    canvas.addEventListener('pointerdown', event => {
      start = [event.offsetX, event.offsetY];
    });
    canvas.addEventListener('pointerup', event => {
      const moved = start && Math.hypot(event.offsetX - start[0], event.offsetY - start[1]);
      if (event.button === 0 && moved !== null && moved < 4) this.choose(event.offsetX, event.offsetY);
    });
  }

  /** Chooses what is drawn at a pixel. */
  choose(x, y) {
    this.chosen = this.find(x, y);
    if (!this.chosen) {
      this.close();
      return null;
    }
    this.refresh();
    this.view.stage.ask();
    return this.chosen;
  }

  /** What is drawn at a pixel: of a cell its nearest vertex; null if nothing is. */
  find(x, y) {
    const found = this.view.stage.pick(x, y);
    const body = found && this.view.bodies[found.body];
    if (!body) return null;
    const { triangles, lines } = body,
      { cell } = found;
    const corners = triangles.length
      ? triangles.subarray(3 * cell, 3 * cell + 3)
      : lines.length
        ? lines.subarray(2 * cell, 2 * cell + 2)
        : [cell];
    const distance = vertex => {
      const [px, py] = this.view.stage.project(body.place(vertex, this.view.frame));
      return Math.hypot(px - x, py - y);
    };
    const vertex = [...corners].sort((a, b) => distance(a) - distance(b))[0];
    const element = triangles.length && body.elements.length ? body.triangleElements[cell] : null;
    return { body, vertex, element };
  }

  close() {
    this.chosen = null;
    by('inspector').hidden = true;
    this.view.stage.ask();
  }

  place() {
    return this.chosen ? this.chosen.body.place(this.chosen.vertex, this.view.frame) : null;
  }

  /** Velocity from the frames before and after [m/s]. */
  #velocity(body, vertex) {
    const {
      frame,
      recording: { times },
    } = this.view;
    const [a, b] = [Math.max(0, frame - 1), Math.min(times.length - 1, frame + 1)];
    if (a === b || !body.has(a) || !body.has(b)) return null;
    const [x, y] = [body.place(vertex, a), body.place(vertex, b)];
    return y.map((end, axis) => (end - x[axis]) / (times[b] - times[a]));
  }

  refresh() {
    if (!this.chosen) return;
    const { body, vertex, element } = this.chosen,
      { frame, recording } = this.view;
    const number = body.vertices[vertex],
      velocity = this.#velocity(body, vertex);
    const rows = [
      ['body', body.name],
      number >= (body.head.first_of_skin ?? Infinity)
        ? ['vertex', `${number - body.head.first_of_skin} of the skin`]
        : ['vertex', `${number} (${number - body.head.first_vertex} of the body)`],
    ];
    if (element !== null) rows.push(['element', `${body.elements[element]} of the body`]);
    rows.push(['position', five(body.place(vertex, frame)) + ' m']);
    if (velocity) rows.push(['velocity', five(velocity) + ' m/s, from frames']);
    recording.colourings.forEach((colouring, c) => {
      const scalars = body.scalars(frame, c);
      const at = scalars?.of === 'elements' ? element : vertex;
      if (!scalars || at === null) return;
      const unit = colouring.unit === '1' ? '' : ` ${colouring.unit}`;
      rows.push([colouring.name, brief(this.view.value(colouring, scalars.values[at])) + unit]);
    });
    terms(by('inspector-rows'), rows);
    by('inspector').hidden = false;
  }
}
