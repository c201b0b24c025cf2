// Loads and gravity as arrows: long where the load is large.
import * as THREE from 'three';
import { brief } from 'pliant/charts';

/** Length of the longest arrow in radii of what the camera was fitted to. */
const LONGEST = 0.3;
/** Orange on paper and on black. */
const COLOUR = 0xe0701a;
const UP = new THREE.Vector3(0, 1, 0);
/** An arrow of length 1 along y. */
const SHAFT = new THREE.CylinderGeometry(0.02, 0.02, 0.72, 8).translate(0, 0.36, 0);
const HEAD = new THREE.ConeGeometry(0.075, 0.28, 14).translate(0, 0.86, 0);

function newArrow(material) {
  const arrow = new THREE.Group();
  for (const geometry of [SHAFT, HEAD]) {
    const part = new THREE.Mesh(geometry, material);
    part.renderOrder = 3;
    arrow.add(part);
  }
  return arrow;
}

/** Unit normal out of a face with these corners; in the plane of an edge. */
function normal([a, b, c], flat) {
  const along = b.clone().sub(a);
  const out = flat ? new THREE.Vector3(along.y, -along.x, 0) : along.cross(c.clone().sub(a));
  return out.normalize();
}

export class Loads {
  constructor(recording, bodies, stage) {
    Object.assign(this, { recording, bodies, stage, flat: recording.dimension === 2 });
    this.material = new THREE.MeshBasicMaterial({ color: COLOUR, depthTest: !this.flat });
    this.loads = (recording.loads ?? []).map(load => this.#load(load));
    const { gravity = [] } = recording;
    if (gravity.length) {
      this.gravity = this.#arrow();
      this.largestGravity = Math.max(...gravity.map(g => Math.hypot(...g)));
      stage.mark('load', 'g', () => (this.gravity.visible ? this.gravity.position.toArray() : null));
    }
  }

  #arrow() {
    const arrow = newArrow(this.material);
    this.stage.arrows.add(arrow);
    return arrow;
  }

  #load(load) {
    const arrows = load.on.map(() => this.#arrow());
    const largest = Math.max(...load.values.flat().map(value => Math.hypot(...value)));
    const tail = () => (arrows[0].visible ? arrows[0].position.toArray() : null);
    const label = this.stage.mark('load', '', tail);
    return { ...load, arrows, largest, label, on: load.on.map(on => on.map(v => this.#vertex(v))) };
  }

  /** The body and the number in it of a vertex of the recording. */
  #vertex(vertex) {
    for (const body of this.bodies) {
      const k = body.vertices.indexOf(vertex);
      if (k >= 0) return [body, k];
    }
    throw new Error(`vertex ${vertex} of a load is not shown`);
  }

  show(frame) {
    this.frame = frame;
    this.loads.forEach(load => this.#showLoad(load, frame));
    this.#showGravity();
  }

  #showLoad({ on, values, arrows, largest, follows, label, key, unit }, frame) {
    const now = values[Math.min(frame, values.length - 1)];
    on.forEach((vertices, k) => {
      const corners = vertices.map(([body, v]) => new THREE.Vector3(...body.place(v, frame)));
      const at = corners.reduce((a, b) => a.clone().add(b)).divideScalar(corners.length);
      const value = new THREE.Vector3(...now[Math.min(k, now.length - 1)]);
      const vector = follows ? normal(corners, this.flat).multiplyScalar(-value.x) : value;
      // What presses ends on the face, what pulls begins there.
      this.#place(arrows[k], at, vector, largest, follows && value.x > 0);
    });
    label.element.textContent = `${key} ${brief(Math.hypot(...now[0]))} ${unit}`;
  }

  #place(arrow, at, vector, largest, ends) {
    const share = vector.length() / largest;
    arrow.visible = share > 1e-3 && Number.isFinite(share) && at.toArray().every(Number.isFinite);
    if (!arrow.visible) return;
    const length = LONGEST * this.stage.radius * Math.max(share, 0.1);
    const direction = vector.clone().normalize();
    arrow.position.copy(at);
    if (ends) arrow.position.addScaledVector(direction, -length);
    arrow.quaternion.setFromUnitVectors(UP, direction);
    arrow.scale.setScalar(length);
  }

  /** In the corner of the grid, where the axes are. */
  #showGravity() {
    const { gravity } = this.recording,
      { corner, step, grid } = this.stage;
    if (!this.gravity || !corner) return;
    const value = new THREE.Vector3(...gravity[Math.min(this.frame, gravity.length - 1)]);
    const at = new THREE.Vector3(...corner);
    at.add(this.flat ? new THREE.Vector3(step, 2 * step, 0) : new THREE.Vector3(step, step, 2 * step));
    this.#place(this.gravity, at, value, this.largestGravity, false);
    this.gravity.scale.setScalar((1.6 * step * value.length()) / this.largestGravity || 1);
    this.gravity.visible &&= grid.visible;
  }
}
