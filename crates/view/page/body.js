// One body: its numbers over time, its textures, and what draws them.
import * as THREE from 'three';
import { readList, Series, MISSING } from 'pliant/data';
import * as shaders from 'pliant/shaders';

const WIDTH = 2048;
/** Triangles beyond which normals while playing are those of facets. */
const SMOOTH_LIMIT = 300000;
const PIN_SIZE = 9;

function texture(array, format, type, internal) {
  const made = new THREE.DataTexture(array, WIDTH, array.length / WIDTH / lanes(format), format, type);
  made.internalFormat = internal;
  made.unpackAlignment = 1;
  made.needsUpdate = true;
  return made;
}
const lanes = format => (format === THREE.RedIntegerFormat ? 1 : 4);
const padded = (Kind, count, width) => new Kind(Math.max(1, Math.ceil(count / WIDTH)) * WIDTH * width);

/** A texture of cells from a function that gives up to four numbers for each. */
function cellTexture(count, cell) {
  const array = padded(Uint32Array, count, 4);
  for (let k = 0; k < count; k++) array.set(cell(k), 4 * k);
  return texture(array, THREE.RGBAIntegerFormat, THREE.UnsignedIntType, 'RGBA32UI');
}

export class Body {
  constructor(recording, number, shared) {
    const head = recording.bodies[number];
    Object.assign(this, { recording, number, shared, head, name: head.name, count: head.vertex_count });
    this.positions = new Series(3 * this.count, head.orders, k => `body${number}.position${k}`);
    this.colourings = recording.colourings.map((colouring, c) => this.#colouring(colouring, c));
    this.objects = [];
  }

  async readLists() {
    const list = name => readList(`body${this.number}.${name}`);
    this.vertices = await list('vertices');
    this.triangles = await list('triangles');
    this.lines = await list('lines');
    this.elements = await list('elements');
    this.triangleElements = await list('triangle_elements');
  }

  #colouring(colouring, c) {
    const found = colouring.bodies[this.number];
    if (!found) return null;
    const of = found.of;
    return {
      of,
      series: orders => new Series(orders, found.orders, k => `body${this.number}.colouring${c}.${k}`),
    };
  }

  /** Names the series now that the lists tell their lengths. */
  prepare() {
    for (const colouring of this.colourings.filter(Boolean)) {
      colouring.series = colouring.series(colouring.of === 'vertices' ? this.count : this.elements.length);
    }
    const { normals, points } = this.#textures();
    const uniforms = {
      ...this.shared,
      positions: { value: this.positionTexture },
      normals: { value: normals },
      scalars: { value: this.scalarTexture },
      low: { value: new THREE.Vector3() },
      unit: { value: new THREE.Vector3(...this.head.step) },
      mode: { value: 0 },
      range: { value: new THREE.Vector2() },
      colour: { value: new THREE.Vector3(...this.head.colour.map(c => c / 255)) },
      facets: { value: false },
      bodyCode: { value: (this.number % 254) + 1 },
    };
    this.uniforms = uniforms;
    const { triangles, lines } = this,
      element = this.triangleElements;
    if (triangles.length) {
      const cells = cellTexture(triangles.length / 3, k => [
        ...triangles.subarray(3 * k, 3 * k + 3),
        element[k] ?? 0,
      ]);
      this.#add(
        THREE.Mesh,
        triangles.length,
        cells,
        shaders.TRIANGLE_VERTEX,
        shaders.TRIANGLE_FRAGMENT,
        'triangle',
      );
    }
    if (lines.length) {
      const cells = cellTexture(lines.length / 2, k => [lines[2 * k], lines[2 * k + 1], 0, 0]);
      this.#add(THREE.Mesh, 3 * lines.length, cells, shaders.LINE_VERTEX, shaders.LINE_FRAGMENT, 'line');
    }
    if (this.head.particles) {
      const cells = cellTexture(this.count, k => [k, points(k), 0, 0]);
      this.#add(THREE.Points, this.count, cells, shaders.POINT_VERTEX, shaders.POINT_FRAGMENT, 'point');
    }
    this.#addPins();
  }

  #textures() {
    this.positionArray = padded(Uint16Array, this.count, 4);
    this.normalArray = padded(Int16Array, this.count, 4);
    this.scalarArray = padded(Uint16Array, this.elements.length, 1);
    const { RGBAIntegerFormat, RedIntegerFormat, UnsignedShortType, ShortType } = THREE;
    this.positionTexture = texture(this.positionArray, RGBAIntegerFormat, UnsignedShortType, 'RGBA16UI');
    this.normalTexture = texture(this.normalArray, RGBAIntegerFormat, ShortType, 'RGBA16I');
    this.scalarTexture = texture(this.scalarArray, RedIntegerFormat, UnsignedShortType, 'R16UI');
    return { normals: this.normalTexture, points: this.#pointSizes() };
  }

  /** Eight times the diameter of a particle in pixels: volumes as masses, between 2 and 16. */
  #pointSizes() {
    const masses = this.head.masses;
    if (!masses) return () => 8 * 5;
    const middle = [...masses].sort((a, b) => a - b)[masses.length >> 1] || 1;
    const usual = this.count > 500 ? 3.5 : 8;
    return k => Math.round(8 * Math.min(16, Math.max(2, usual * Math.cbrt(masses[k] / middle))));
  }

  #addPins() {
    const place = new Map(Array.from(this.vertices, (vertex, k) => [vertex, k]));
    const held = this.recording.pins.map(vertex => place.get(vertex)).filter(k => k !== undefined);
    if (!held.length) return;
    const cells = cellTexture(held.length, k => [held[k], 8 * PIN_SIZE, 0, 0]);
    const pins = this.#add(
      THREE.Points,
      held.length,
      cells,
      shaders.POINT_VERTEX,
      shaders.PIN_FRAGMENT,
      'pin',
    );
    pins.material.uniforms.colour = { value: new THREE.Vector3(1, 1, 1) };
    pins.material.polygonOffset = pins.material.transparent = true;
    pins.renderOrder = 2;
  }

  #add(Kind, count, cells, vertexShader, fragmentShader, role) {
    const geometry = new THREE.BufferGeometry();
    geometry.setDrawRange(0, count);
    const uniforms = { ...this.uniforms, cells: { value: cells } };
    const material = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3,
      vertexShader,
      fragmentShader,
      uniforms,
      side: THREE.DoubleSide,
    });
    const object = new Kind(geometry, material);
    object.frustumCulled = false;
    object.userData.role = role;
    this.objects.push(object);
    return object;
  }

  /** Whether a frame has been read. */
  has(frame) {
    return this.positions.frame(frame, this.recording.chunk) !== undefined;
  }

  origin(frame) {
    const centre = this.head.centres[frame] ?? [0, 0, 0];
    return centre.map((c, axis) => c + this.head.low[axis]);
  }

  /** Position of a vertex of this body in a frame [m]. */
  place(vertex, frame) {
    const codes = this.positions.frame(frame, this.recording.chunk),
      origin = this.origin(frame);
    return origin.map((low, axis) => low + this.head.step[axis] * codes[axis * this.count + vertex]);
  }

  /** Puts a frame into the textures, coloured by number `colouring`. */
  show(frame, colouring, playing) {
    const { count, positionArray } = this,
      codes = this.positions.frame(frame, this.recording.chunk);
    for (let i = 0, o = 0; i < count; i++, o += 4) {
      positionArray[o] = codes[i];
      positionArray[o + 1] = codes[count + i];
      positionArray[o + 2] = codes[2 * count + i];
    }
    this.uniforms.low.value.set(...this.origin(frame));
    const facets = playing && this.triangles.length > 3 * SMOOTH_LIMIT;
    this.uniforms.facets.value = facets;
    if (this.triangles.length && !facets) this.#normals(codes);
    this.#scalars(frame, colouring);
    this.positionTexture.needsUpdate = true;
  }

  #scalars(frame, number) {
    const { values, of } = this.scalars(frame, number) ?? {};
    this.uniforms.mode.value = !values ? 0 : of === 'vertices' ? 1 : 2;
    if (of === 'vertices') for (let i = 0; i < this.count; i++) this.positionArray[4 * i + 3] = values[i];
    if (of === 'elements') {
      this.scalarArray.set(values);
      this.scalarTexture.needsUpdate = true;
    }
  }

  /** Codes of a colouring in a frame, and what they are of; null where the body has none. */
  scalars(frame, number) {
    const colouring = this.colourings[number];
    const values = colouring?.series.frame(frame, this.recording.chunk);
    return values ? { values, of: colouring.of } : null;
  }

  /** Normals of vertices, weighted by area. */
  #normals(codes) {
    const {
      count: n,
      triangles,
      normalArray: out,
      head: {
        step: [sx, sy, sz],
      },
    } = this;
    const sum = (this.normalSum ??= new Float32Array(3 * n));
    sum.fill(0);
    for (let k = 0; k < triangles.length; k += 3) {
      const a = triangles[k],
        b = triangles[k + 1],
        c = triangles[k + 2];
      const ux = (codes[b] - codes[a]) * sx,
        vx = (codes[c] - codes[a]) * sx;
      const uy = (codes[n + b] - codes[n + a]) * sy,
        vy = (codes[n + c] - codes[n + a]) * sy;
      const uz = (codes[2 * n + b] - codes[2 * n + a]) * sz,
        vz = (codes[2 * n + c] - codes[2 * n + a]) * sz;
      const x = uy * vz - uz * vy,
        y = uz * vx - ux * vz,
        z = ux * vy - uy * vx;
      for (const v of [3 * a, 3 * b, 3 * c]) {
        sum[v] += x;
        sum[v + 1] += y;
        sum[v + 2] += z;
      }
    }
    for (let i = 0, s = 0, o = 0; i < n; i++, s += 3, o += 4) {
      const scale = 32767 / (Math.hypot(sum[s], sum[s + 1], sum[s + 2]) || 1);
      out[o] = sum[s] * scale;
      out[o + 1] = sum[s + 1] * scale;
      out[o + 2] = sum[s + 2] * scale;
    }
    this.normalTexture.needsUpdate = true;
  }

  /** Smallest and largest finite code of a colouring in a frame; null without any. */
  codeRange(frame, number) {
    const { values } = this.scalars(frame, number) ?? {};
    if (!values) return null;
    let low = MISSING,
      high = -1;
    for (const code of values)
      if (code !== MISSING) {
        if (code < low) low = code;
        if (code > high) high = code;
      }
    return high < 0 ? null : [low, high];
  }

  /** Sum of the positions in a frame [m]. */
  sum(frame) {
    const codes = this.positions.frame(frame, this.recording.chunk),
      n = this.count;
    const of = axis => codes.subarray(axis * n, (axis + 1) * n).reduce((total, code) => total + code, 0);
    const axes = this.origin(frame).map((low, axis) => n * low + this.head.step[axis] * of(axis));
    return new THREE.Vector3(...axes);
  }

  /** Adds the positions of a frame to a box. */
  extend(box, frame) {
    const codes = this.positions.frame(frame, this.recording.chunk),
      origin = this.origin(frame);
    for (let axis = 0; axis < 3; axis++) {
      let low = MISSING,
        high = 0;
      for (let i = axis * this.count; i < (axis + 1) * this.count; i++) {
        if (codes[i] !== MISSING) {
          low = Math.min(low, codes[i]);
          high = Math.max(high, codes[i]);
        }
      }
      if (low <= high) {
        box.min.setComponent(
          axis,
          Math.min(box.min.getComponent(axis), origin[axis] + this.head.step[axis] * low),
        );
        box.max.setComponent(
          axis,
          Math.max(box.max.getComponent(axis), origin[axis] + this.head.step[axis] * high),
        );
      }
    }
  }
}
