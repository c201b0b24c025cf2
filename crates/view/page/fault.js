// Faults of a run and of the connection: what the run says, where it happened, and the way back.
import * as THREE from 'three';
import { brief } from 'pliant/charts';
import { by, element } from 'pliant/panel';

export class Fault {
  constructor(view) {
    Object.assign(this, { view, now: null, cell: null });
    this.notice = Object.assign(element('div', ''), { id: 'notice', hidden: true });
    this.notice.setAttribute('role', 'alert');
    by('stage').append(this.notice);
    this.outline = new THREE.LineSegments(
      new THREE.BufferGeometry(),
      new THREE.LineBasicMaterial({ color: 0xe03020, depthTest: false, transparent: true }),
    );
    Object.assign(this.outline, { visible: false, frustumCulled: false, renderOrder: 6 });
    view.stage.scene.add(this.outline);
    view.stage.mark('fault', '', () => this.centre);
  }

  #say(text, bad, buttons) {
    const made = buttons.map(([name, act]) => {
      const button = element('button', name);
      button.addEventListener('click', act);
      return button;
    });
    this.notice.replaceChildren(element('span', text), ...made);
    this.notice.classList.toggle('bad', bad);
    this.notice.hidden = false;
  }

  /** What a state says of a fault. */
  show({ fault, can_go_back: canGoBack }) {
    if (JSON.stringify(fault) === JSON.stringify(this.now)) return;
    this.now = fault;
    this.notice.hidden = fault === null;
    if (fault) this.#say(told(fault), true, canGoBack ? [[BACK, () => this.view.goBack()]] : []);
    this.cell = fault && this.#find(fault);
    this.place();
  }

  /** Corners that are drawn of the element or vertex. */
  #find({ body: name, element: number, vertex }) {
    const body = this.view.bodies.find(body => body.name === name) ?? this.view.bodies[0];
    const shown = number === null ? -1 : body.elements.indexOf(number),
      corners = [];
    body.triangleElements.forEach((of, k) => {
      if (of === shown) corners.push(...body.triangles.subarray(3 * k, 3 * k + 3));
    });
    const at = vertex === null ? -1 : body.vertices.indexOf(vertex);
    if (!corners.length && at >= 0) corners.push(at, at, at);
    return corners.length ? { body, corners } : null;
  }

  /** Mark where the element is now. */
  place() {
    this.outline.visible = this.cell !== null;
    this.centre = null;
    if (!this.cell) return;
    const { body, corners } = this.cell,
      places = corners.map(vertex => new THREE.Vector3(...body.place(vertex, 0)));
    const sides = places.flatMap((place, k) => [place, places[k % 3 === 2 ? k - 2 : k + 1]]);
    this.outline.geometry.dispose();
    this.outline.geometry = new THREE.BufferGeometry().setFromPoints(sides);
    const sum = places.reduce((sum, place) => sum.add(place), new THREE.Vector3());
    this.centre = sum.divideScalar(places.length).toArray();
    this.view.stage.ask();
  }

  disconnected(again, known) {
    const text = !known
      ? 'No connection: the run has ended, or another page has it.'
      : again
        ? 'The connection is lost; trying again.'
        : 'The run has ended; start `pliant live` again.';
    this.#say(text, false, again ? [] : [['try again', () => this.view.link.connect()]]);
    this.now = undefined;
  }

  reconnected() {
    this.notice.hidden = true;
    this.now = null;
  }
}

const BACK = 'back to the last good state';

function told({ message, time, body, element: number, vertex }) {
  const where = [
    body !== null && `body ${body}`,
    number !== null && `element ${number}`,
    vertex !== null && `vertex ${vertex}`,
  ].filter(Boolean);
  return [message, [`${brief(time)} s`, ...where].join(' · ')].join('\n');
}
