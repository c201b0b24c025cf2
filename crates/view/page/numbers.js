// Numbers of a run in the form in which bodies take those of a recording: codes of 16 bits in a box.
import { MISSING } from 'pliant/data';

const LARGEST = MISSING - 1;

/** Smallest and largest of the finite numbers at these places; null if there are none. */
export function extent(values, places) {
  let low = Infinity,
    high = -Infinity;
  for (const k of places) {
    const value = values[k];
    if (value < low && value > -Infinity) low = value;
    if (value > high && value < Infinity) high = value;
  }
  return low <= high ? [low, high] : null;
}

const code = (value, low, step) =>
  Number.isFinite(value) ? Math.min(LARGEST, Math.max(0, Math.round((value - low) / step))) : MISSING;

/** Numbers of one body: of its vertices by their number in the run, of its elements by theirs. */
class BodyNumbers {
  constructor(body, dimension, elementPlaces) {
    Object.assign(this, { body, dimension, elementPlaces });
    this.places = [0, 1, 2].map(axis =>
      axis < dimension ? body.vertices.map(vertex => dimension * vertex + axis) : new Uint32Array(),
    );
    this.positions = new Uint16Array(3 * body.count);
    this.speeds = new Uint16Array(body.count);
    this.values = new Uint16Array(body.elements.length);
    body.head.centres = [];
    body.positions = { frame: () => this.positions };
  }

  /** Of colouring `colouring`: none, speed, or a measure of elements that is sent only while it is chosen. */
  colourings(measures, chosen) {
    const speed = { of: 'vertices', series: { frame: () => this.speeds } };
    const measure = name => ({
      of: 'elements',
      series: { frame: () => (this.hasValues && chosen() === name ? this.values : undefined) },
    });
    return [null, speed, ...measures.map(name => (this.elementPlaces ? measure(name) : null))];
  }

  /** Positions in the box of this frame. */
  place(positions) {
    const { body } = this,
      n = body.count;
    for (let axis = 0; axis < this.dimension; axis++) {
      const places = this.places[axis],
        [low, high] = extent(positions, places) ?? [0, 0],
        step = (high - low) / LARGEST || 1e-30;
      for (let i = 0; i < n; i++) this.positions[axis * n + i] = code(positions[places[i]], low, step);
      body.head.low[axis] = low;
      body.head.step[axis] = step;
    }
    body.uniforms.unit.value.set(...body.head.step);
  }

  /** Speeds and values within their ranges. */
  colour(frame, speedRange, valueRange) {
    fill(this.speeds, frame.speeds, this.body.vertices, speedRange);
    this.hasValues = frame.values.length > 0 && this.elementPlaces !== null;
    if (this.hasValues) fill(this.values, frame.values, this.elementPlaces, valueRange);
  }
}

function fill(codes, values, places, [low, high]) {
  const step = (high - low) / LARGEST || 1;
  for (let k = 0; k < places.length; k++) codes[k] = code(values[places[k]], low, step);
}

/** Numbers of all bodies; ranges are those of all frames since they were forgotten. */
export class Numbers {
  constructor(bodies, hello, chosen) {
    this.chosen = chosen;
    const places = bodies.map((_, b) => this.#elementPlaces(bodies, b));
    this.bodies = bodies.map((body, b) => new BodyNumbers(body, hello.dimension, places[b]));
    this.bodies.forEach(numbers => {
      numbers.body.colourings = numbers.colourings(hello.measures, chosen);
    });
    this.forget();
  }

  /** Places of the elements shown among the values of the run, which has those of all bodies; else null. */
  #elementPlaces(bodies, number) {
    const has = body => body.colourings.some(colouring => colouring?.of === 'elements');
    if (!has(bodies[number])) return null;
    const before = bodies.slice(0, number).filter(has);
    const first = before.reduce((sum, body) => sum + body.head.element_count, 0);
    return bodies[number].elements.map(element => first + element);
  }

  forget() {
    this.speedRange = null;
    this.valueRange = null;
  }

  forgetValues() {
    this.valueRange = null;
  }

  take(frame) {
    this.speedRange = wider(this.speedRange, extent(frame.speeds, frame.speeds.keys()));
    if (frame.values.length) {
      this.valueRange = wider(this.valueRange, extent(frame.values, frame.values.keys()));
    }
    for (const numbers of this.bodies) {
      numbers.place(frame.positions);
      numbers.colour(frame, this.speedRange ?? [0, 0], this.valueRange ?? [0, 0]);
    }
  }
}

function wider(range, more) {
  if (!range || !more) return range ?? more;
  return [Math.min(range[0], more[0]), Math.max(range[1], more[1])];
}
