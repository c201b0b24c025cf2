// The stage: renderer, camera, grid, walls, labels. It draws when something changed, and only then.
import * as THREE from 'three';
import { OrbitControls } from 'orbit';

const FIELD_OF_VIEW = 35;
/** Grid lines stay fewer than a few times this. */
const MOST_CELLS = 15;
const FIRST_DIRECTION = [0.62, -1, 0.42];

/** Whether pictures are drawn by the processor. */
function drawsInSoftware() {
  const gl = document.createElement('canvas').getContext('webgl2');
  if (!gl) return null;
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  const name = gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
  gl.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

/** 1, 2 or 5 times a power of ten, at most `length`. */
function roundStep(length) {
  const power = 10 ** Math.floor(Math.log10(length));
  return power * ([5, 2, 1].find(factor => factor * power <= length * 1.0000001) ?? 1);
}

/** A length with its unit. */
export function metres(length) {
  const [factor, unit] = [
    [1e3, 'km'],
    [1, 'm'],
    [1e-2, 'cm'],
    [1e-3, 'mm'],
    [1e-6, 'µm'],
  ].find(([size]) => length >= size * 0.999) ?? [1, 'm'];
  return `${Number((length / factor).toPrecision(4))} ${length >= 1e6 ? 'Mm' : unit}`.replace(
    /^(\S+) Mm$/,
    `${length.toExponential(0)} m`,
  );
}

const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

export class Stage {
  constructor(canvas, labels, flat) {
    const software = drawsInSoftware();
    if (software === null) throw new Error('this browser has no WebGL 2');
    Object.assign(this, {
      canvas,
      labels,
      flat,
      software,
      marks: [],
      decor: new THREE.Group(),
      arrows: new THREE.Group(),
      scene: new THREE.Scene(),
    });
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !software });
    this.renderer.setPixelRatio(software ? 1 : Math.min(devicePixelRatio, 2));
    this.camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1, 1e-3, 1e3);
    this.camera.up.set(...(flat ? [0, 1, 0] : [0, 0, 1]));
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableRotate = !flat;
    this.controls.screenSpacePanning = true;
    if (flat) {
      this.controls.mouseButtons.LEFT = THREE.MOUSE.PAN;
      this.controls.touches.ONE = THREE.TOUCH.PAN;
    }
    this.controls.addEventListener('change', () => this.ask());
    this.scene.add(this.decor, this.arrows);
    this.pixel = new THREE.WebGLRenderTarget(1, 1);
    this.edges = { value: 0.4 };
    this.shared = {
      viewport: { value: new THREE.Vector2() },
      pixelRatio: { value: this.renderer.getPixelRatio() },
      thickness: { value: 2 },
      edges: this.edges,
      flatLight: { value: flat },
      picking: { value: false },
    };
    new ResizeObserver(() => {
      this.resize();
      this.draw();
    }).observe(canvas.parentElement);
    canvas.addEventListener('webglcontextlost', event => {
      event.preventDefault();
      this.onLost?.(true);
    });
    canvas.addEventListener('webglcontextrestored', () => {
      this.onLost?.(false);
      this.ask();
    });
    this.resize();
  }

  /** Draws with the next picture of the browser. */
  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      if (this.asked) this.draw();
    });
  }

  draw() {
    this.asked = false;
    this.renderer.render(this.scene, this.camera);
    this.#placeMarks();
    this.onDrawn?.();
  }

  resize() {
    const { clientWidth: w, clientHeight: h } = this.canvas.parentElement;
    this.renderer.setSize(w, h, false);
    this.camera.aspect = w / Math.max(h, 1);
    this.camera.updateProjectionMatrix();
    this.shared.viewport.value.set(w, h);
  }

  /** Shows a box whole; `turned` looks from the first direction again. */
  fit(box, turned) {
    const centre = box.getCenter(new THREE.Vector3()),
      radius = (this.radius = Math.max(box.getSize(new THREE.Vector3()).length() / 2, 1e-9));
    const half = ((FIELD_OF_VIEW / 2) * Math.PI) / 180,
      narrow = Math.atan(Math.tan(half) * Math.min(1, this.camera.aspect));
    const direction = this.flat
      ? new THREE.Vector3(0, 0, 1)
      : turned
        ? new THREE.Vector3(...FIRST_DIRECTION).normalize()
        : this.camera.position.clone().sub(this.controls.target).normalize();
    this.controls.target.copy(centre);
    this.camera.position.copy(centre).addScaledVector(direction, (radius * 1.08) / Math.sin(narrow));
    this.#clip();
    this.controls.update();
    this.ask();
  }

  /** Moves the camera by `step` as a body has moved. */
  move(step) {
    this.controls.target.add(step);
    this.camera.position.add(step);
    this.controls.update();
  }

  #clip() {
    this.camera.near = this.radius / 200;
    this.camera.far = this.radius * 400;
    this.camera.updateProjectionMatrix();
  }

  colours() {
    this.scene.background = new THREE.Color(css('--paper'));
  }

  /** Grid and walls around the `box` of all frames, with cells for looking at `focus`. */
  decorate(box, focus, walls) {
    this.decor.clear();
    this.marks.filter(mark => mark.decor).forEach(mark => mark.element.remove());
    this.marks = this.marks.filter(mark => !mark.decor);
    this.colours();
    const size = box.getSize(new THREE.Vector3()),
      centre = box.getCenter(new THREE.Vector3());
    const length = Math.max(size.x, size.y, this.flat ? 0 : size.z * 0.5, 1e-9);
    const seen = Math.max(...focus.getSize(new THREE.Vector3()).toArray(), length / MOST_CELLS);
    const step = (this.step = roundStep(seen / 4)),
      cells = Math.ceil(length / step / 2) + 2,
      snap = c => Math.round(c / step) * step;
    const middle = [snap(centre.x), snap(centre.y)],
      level = this.flat ? -0.002 * length : box.min.z - 1e-3 * length;
    const line = [],
      reach = cells * step;
    for (let k = -cells; k <= cells; k++) {
      line.push(
        middle[0] + k * step,
        middle[1] - reach,
        level,
        middle[0] + k * step,
        middle[1] + reach,
        level,
      );
      line.push(
        middle[0] - reach,
        middle[1] + k * step,
        level,
        middle[0] + reach,
        middle[1] + k * step,
        level,
      );
    }
    this.grid = new THREE.Group();
    this.grid.add(this.#lines(line, css('--grid')));
    const [x, y] = [middle[0] - reach, middle[1] - reach];
    this.corner = [x, y, level];
    this.grid.add(
      this.#lines(
        [x, y, level, x + 2 * reach, y, level, x, y, level, x, y + 2 * reach, level],
        css('--axis'),
      ),
    );
    this.decor.add(this.grid);
    this.mark('axis', 'x', () => [x + 2 * reach, y, level], true);
    this.mark('axis', 'y', () => [x, y + 2 * reach, level], true);
    if (!this.flat) {
      this.grid.add(this.#lines([x, y, level, x, y, level + 2 * step], css('--axis')));
      this.mark('axis', 'z', () => [x, y, level + 2 * step], true);
    }
    walls.forEach(wall => this.#wall(wall, centre, reach));
  }

  #lines(points, colour) {
    const geometry = new THREE.BufferGeometry().setAttribute(
      'position',
      new THREE.Float32BufferAttribute(points, 3),
    );
    return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: colour }));
  }

  /** A half-space: in space a pane, in the plane a strip behind its line. */
  #wall(wall, centre, reach) {
    const normal = new THREE.Vector3(...wall.normal),
      foot = new THREE.Vector3(...wall.point);
    const place = centre.clone().addScaledVector(normal, foot.sub(centre).dot(normal));
    const depth = this.flat ? 0.12 * reach : 2 * reach;
    const geometry = new THREE.PlaneGeometry(2 * reach, depth);
    const material = new THREE.MeshBasicMaterial({
      color: css('--axis'),
      transparent: true,
      opacity: this.flat ? 0.55 : 0.18,
      side: THREE.DoubleSide,
      depthWrite: false,
    });
    const pane = new THREE.Mesh(geometry, material);
    if (this.flat) {
      pane.rotation.z = Math.atan2(normal.y, normal.x) - Math.PI / 2;
      place.addScaledVector(normal, -depth / 2).setZ(-0.001 * reach);
    } else {
      pane.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), normal);
    }
    pane.position.copy(place);
    pane.renderOrder = 1;
    this.decor.add(pane);
  }

  /** A label in the picture at `place()`; nothing is shown where that is null. */
  mark(kind, text, place, decor = false) {
    const element = document.createElement('span');
    element.className = kind;
    element.textContent = text;
    this.labels.append(element);
    const mark = { element, place, decor, kind };
    this.marks.push(mark);
    return mark;
  }

  #placeMarks() {
    for (const { element, place, decor, kind } of this.marks) {
      const at = place(),
        seen = at && this.project(at);
      element.hidden = !seen || seen[2] > 1 || (decor && !this.grid.visible);
      if (element.hidden) continue;
      const back = kind === 'mark' ? '-50%, -50%' : '-4px, -50%';
      element.style.transform = `translate(${seen[0]}px, ${seen[1]}px) translate(${back})`;
    }
  }

  /** Pixel of the canvas at which a place is seen, and its depth. */
  project(place) {
    const p = new THREE.Vector3(...place).project(this.camera);
    const { clientWidth: w, clientHeight: h } = this.canvas;
    return [((p.x + 1) / 2) * w, ((1 - p.y) / 2) * h, p.z];
  }

  /** Number of the body at a pixel, and of its triangle, segment or vertex; null if none is there. */
  pick(x, y) {
    const { renderer, scene, camera, pixel, shared } = this,
      { clientWidth: w, clientHeight: h } = this.canvas;
    const { background } = scene;
    camera.setViewOffset(w, h, Math.floor(x), Math.floor(y), 1, 1);
    scene.background = null;
    this.decor.visible = this.arrows.visible = false;
    shared.picking.value = true;
    renderer.setRenderTarget(pixel);
    renderer.setClearColor(0, 0);
    renderer.clear();
    renderer.render(scene, camera);
    const found = new Uint8Array(4);
    renderer.readRenderTargetPixels(pixel, 0, 0, 1, 1, found);
    renderer.setRenderTarget(null);
    shared.picking.value = false;
    this.decor.visible = this.arrows.visible = true;
    scene.background = background;
    camera.clearViewOffset();
    return found[3] ? { body: found[3] - 1, cell: found[0] | (found[1] << 8) | (found[2] << 16) } : null;
  }
}
