// Grabbing: a vertex follows the pointer in the plane through it that faces the camera.
import * as THREE from 'three';
import { by } from 'pliant/panel';

/** Pixels around the pointer within which a vertex is taken where nothing is drawn under it. */
const REACH = 22;
/** Drags that may wait for the run; meanwhile the newest target is kept. */
const MOST_WAITING = 3;
const LATENCIES = 500;

export class Grab {
  constructor(view) {
    Object.assign(this, { view, held: null, wanted: null, sent: [], latencies: [] });
    const { canvas, scene } = view.stage;
    this.string = new THREE.Line(
      new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3()]),
      new THREE.LineBasicMaterial({ color: 0xd55e00, depthTest: false, transparent: true }),
    );
    Object.assign(this.string, { visible: false, frustumCulled: false, renderOrder: 5 });
    scene.add(this.string);
    view.stage.mark('target', '', () => this.target());
    // Before the camera's controls and the inspector, which listen at the canvas itself.
    const first = { capture: true };
    canvas.parentElement.addEventListener('pointerdown', event => this.#down(event), first);
    canvas.parentElement.addEventListener('pointermove', event => this.#move(event), first);
    for (const end of ['pointerup', 'pointercancel'])
      canvas.parentElement.addEventListener(end, event => this.#up(event), first);
    this.tool = false;
  }

  get tool() {
    return this.chosen;
  }

  set tool(on) {
    this.chosen = on;
    this.view.stage.canvas.style.cursor = on ? 'grab' : '';
    by('grab')?.setAttribute('aria-pressed', on);
  }

  /** Place that the vertex is drawn to [m]; null if none is. */
  target() {
    return this.held?.target ?? this.view.grabbed?.target ?? null;
  }

  #down(event) {
    if (event.target !== this.view.stage.canvas || event.button !== 0 || this.held) return;
    if (!this.tool && !event.shiftKey) return;
    const found = this.#find(event.offsetX, event.offsetY);
    if (!found) return;
    const { body, vertex } = found,
      at = new THREE.Vector3(...body.place(vertex, 0));
    const facing = this.view.stage.camera.getWorldDirection(new THREE.Vector3());
    const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(facing, at);
    this.held = { body, vertex, plane, target: at.toArray(), pointer: event.pointerId };
    this.view.stage.canvas.setPointerCapture(event.pointerId);
    event.stopPropagation();
    this.held.command = this.view.tell({
      do: 'grab',
      vertex: body.vertices[vertex],
      target: this.#sendable(at),
    });
    this.draw();
  }

  #find(x, y) {
    return this.view.inspector.find(x, y) ?? this.#nearest(x, y);
  }

  #nearest(x, y) {
    let best = null,
      within = REACH;
    for (const body of this.view.bodies)
      for (let vertex = 0; vertex < body.count; vertex++) {
        const [px, py, depth] = this.view.stage.project(body.place(vertex, 0)),
          away = Math.hypot(px - x, py - y);
        if (away < within && depth < 1) [within, best] = [away, { body, vertex }];
      }
    return best;
  }

  #move(event) {
    if (!this.#holds(event)) return;
    event.stopPropagation();
    const { canvas, camera } = this.view.stage,
      { left, top, width, height } = canvas.getBoundingClientRect();
    const at = new THREE.Vector2(
      ((event.clientX - left) / width) * 2 - 1,
      1 - ((event.clientY - top) / height) * 2,
    );
    const ray = new THREE.Raycaster();
    ray.setFromCamera(at, camera);
    const place = ray.ray.intersectPlane(this.held.plane, new THREE.Vector3());
    if (!place) return;
    this.held.target = place.toArray();
    this.wanted = { place, since: performance.now() };
    this.draw();
    this.#ask();
  }

  #holds(event) {
    return this.held?.pointer === event.pointerId;
  }

  #up(event) {
    if (!this.#holds(event)) return;
    event.stopPropagation();
    this.#send();
    this.release();
  }

  release() {
    if (!this.held) return;
    this.held = null;
    this.wanted = null;
    this.view.tell({ do: 'release' });
    this.draw();
  }

  /** Lets go where the run refuses to hold the vertex. */
  refused(command) {
    if (this.held?.command !== command) return;
    this.held = this.wanted = null;
    this.draw();
  }

  /** One drag for each picture of the browser. */
  #ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      if (this.sent.length < MOST_WAITING) this.#send();
    });
  }

  #send() {
    if (!this.wanted) return;
    const { place, since } = this.wanted;
    this.wanted = null;
    const command = this.view.tell({ do: 'drag', target: this.#sendable(place) });
    if (command) this.sent.push({ command, since });
  }

  #sendable(place) {
    return place.toArray().slice(0, this.view.recording.dimension);
  }

  /** After a picture of the state that follows command `executed`. */
  drawn(executed) {
    const done = this.sent.filter(({ command }) => command <= executed);
    this.sent = this.sent.filter(({ command }) => command > executed);
    const now = performance.now();
    this.latencies.push(...done.map(({ since }) => now - since));
    this.latencies.splice(0, this.latencies.length - LATENCIES);
    if (this.wanted) this.#ask();
  }

  /** The string from the vertex to its target. */
  draw() {
    const from = this.#vertexPlace(),
      to = this.target();
    this.string.visible = Boolean(from && to);
    if (this.string.visible) {
      const ends = this.string.geometry.getAttribute('position');
      ends.setXYZ(0, ...from);
      ends.setXYZ(1, to[0], to[1], to[2] ?? 0);
      ends.needsUpdate = true;
    }
    this.view.stage.ask();
  }

  #vertexPlace() {
    if (this.held) return this.held.body.place(this.held.vertex, 0);
    return this.view.grabbed ? this.view.placeOf(this.view.grabbed.vertex) : null;
  }
}
