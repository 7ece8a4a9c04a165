// The 3D view: owns the state, the viewpoint and the painter, and reacts to the reader.

import { PerspectiveCamera, Quaternion, Spherical, Vector3 } from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

import { h, section } from '../dom.js';
import { count, plural } from '../format.js';
import { CanvasPainter } from './canvas_painter.js';
import { loadMesh } from './mesh.js';
import { buildModel, samplePoints } from './model.js';
import { buildCameraCard, buildToolbar } from './panel.js';
import { WebglPainter, webglWorks } from './webgl_painter.js';

const Y_UP = new Vector3(0, 1, 0);
const FIELD_OF_VIEW_DEG = 45;
const PICK_RADIUS_PX = { mouse: 14, touch: 26 };
const CLICK_TRAVEL_PX = 5;
const KEY_TURN_RAD = 0.12;
const KEY_ZOOM = 1.15;
const LOOK_THROUGH_FILLED = 0.85;
const FIT_SAMPLES = 3000;
const FIT_QUANTILE = 0.97;
const FILLED = 0.92; // of the picture, by what has to be in it

function readPalette() {
  const style = getComputedStyle(document.documentElement);
  const rgb = (name) => {
    const hex = style.getPropertyValue(name).trim().slice(1);
    return [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);
  };
  return { background: rgb('--stage'), camera: rgb('--camera'), selected: rgb('--selected'), link: rgb('--camera') };
}

/** What becomes of the mesh: 'none', 'loading' (later 'shown' or 'failed'), 'too_large', 'no_webgl'. */
function meshState(modelFile, useWebgl) {
  if (!modelFile) return 'none';
  if (modelFile.glb === null) return 'too_large';
  return useWebgl ? 'loading' : 'no_webgl';
}

function megabytes(bytes) {
  return `${(bytes / 2 ** 20).toFixed(1)} MB`;
}

function meshSentence(state, file, mesh) {
  const elsewhere = file ? `open ${file.name} beside this page in a viewer of 3D models` : '';
  switch (state) {
    case 'loading':
      return 'The mesh is being unpacked.';
    case 'shown':
      return `Mesh of ${plural(mesh.faces, 'face')}${mesh.pages > 0 ? ` with ${plural(mesh.pages, 'page')} of texture` : ''}, without shading: its light is that of the photographs.`;
    case 'too_large':
      return `The mesh of ${megabytes(file.bytes)} is too large for this page (${megabytes(file.limitBytes)}): ${elsewhere}.`;
    case 'no_webgl':
      return `To see the mesh, ${elsewhere}.`;
    case 'failed':
      return `The mesh could not be shown here: ${elsewhere}.`;
    default:
      return '';
  }
}

class Viewer {
  constructor(report, models, modelFile, tooltip) {
    this.report = report;
    this.models = models;
    this.modelFile = modelFile;
    this.tooltip = tooltip;
    this.model = models[0];
    this.useWebgl = !location.hash.includes('2d') && webglWorks();
    this.meshState = meshState(modelFile, this.useWebgl);
    this.mesh = null; // until it is loaded
    const hasMesh = this.meshState === 'loading';
    this.up = 'cameras';
    this.rotation = new Quaternion();
    this.state = { component: 0, showMesh: hasMesh, showPoints: !hasMesh, showCameras: !hasMesh, showLinks: false, pointSize: 2, cameraSize: 1, selected: -1 };
    this.camera = new PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.01, 1000);
    this.buildElements();
  }

  buildElements() {
    const label = `3D view: ${plural(this.model.positions.length / 3, 'point')}, ${plural(this.model.poses.length, 'camera')}. Arrow keys turn, plus and minus zoom, brackets step through the cameras, R resets.`;
    this.canvas = h('canvas', { class: 'stage', tabindex: 0, role: 'application', 'aria-label': label });
    this.frame = h('div', { class: 'stage-frame' }, this.canvas);
    this.card = h('aside', { class: 'camera-card', 'aria-live': 'polite', 'aria-label': 'Selected camera', hidden: true });
    this.message = h('p', { class: 'hint' });
    this.toolbar = buildToolbar(this.state, this.models, this.meshState === 'loading', {
      changed: () => this.stateChanged(),
      setUp: (up) => this.setUp(up),
      setComponent: (index) => this.setComponent(index),
      reset: () => this.resetView(),
    });
    this.element = section('view', 'Model', this.toolbar.element, h('div', { class: 'viewer' }, this.frame, this.card), this.message);
  }

  /** Once the elements are in the document. */
  start() {
    this.painter = this.useWebgl ? new WebglPainter(this.canvas) : new CanvasPainter(this.canvas);
    document.body.dataset.renderer = this.useWebgl ? 'webgl' : '2d';
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.zoomToCursor = true;
    this.controls.enableZoom = false;
    this.controls.addEventListener('change', () => this.requestRender());
    this.listen();
    this.resize();
    this.setComponent(0);
    this.renderNow();
    this.tellCheck();
    if (this.meshState === 'loading') this.startMesh();
  }

  /** For tests. */
  tellCheck() {
    if (this.modelFile) document.body.dataset.mesh = this.meshState;
    if (location.hash.includes('check')) document.body.dataset.drawn = String(this.countDrawnPixels());
  }

  async startMesh() {
    try {
      this.mesh = await loadMesh(this.modelFile.glb);
      this.meshState = 'shown';
      this.painter.setMesh(this.mesh.object);
      this.modelFile.glb = null; // its memory is no longer needed
    } catch (error) {
      console.warn(error);
      this.meshState = 'failed';
      Object.assign(this.state, { showMesh: false, showPoints: true, showCameras: true });
      this.toolbar.showState();
    }
    this.tellCounts();
    this.stateChanged();
    this.resetView();
    this.renderNow();
    this.tellCheck();
  }

  /** What the view is about: the mesh while it is shown, else the points. */
  subject() {
    return this.state.showMesh && this.mesh && this.state.component === 0 ? this.mesh : this.model;
  }

  listen() {
    new ResizeObserver(() => this.resize()).observe(this.frame);
    window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.stateChanged());
    // The wheel scrolls the page until the reader has taken hold of the view.
    this.canvas.addEventListener('pointerdown', (event) => this.pointerDown(event), { capture: true });
    this.canvas.addEventListener('focus', () => (this.controls.enableZoom = true));
    this.canvas.addEventListener('blur', () => (this.controls.enableZoom = false));
    this.canvas.addEventListener('pointerup', (event) => this.pointerUp(event));
    this.canvas.addEventListener('pointermove', (event) => this.hover(event));
    this.canvas.addEventListener('pointerleave', () => this.tooltip.hide());
    this.canvas.addEventListener('keydown', (event) => this.keyDown(event));
  }

  requestRender() {
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      this.controls.update(); // asks for the next frame by its change event while it moves
      this.renderNow();
    });
  }

  renderNow() {
    this.painter.render(this.camera, this.rotation);
  }

  stateChanged() {
    this.painter.setState(this.state, readPalette());
    this.requestRender();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.frame;
    if (width === 0 || height === 0) return;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.painter.resize(width, height, window.devicePixelRatio || 1);
    if (this.painter.model) {
      this.painter.setState(this.state, readPalette());
      this.renderNow();
    }
  }

  setComponent(index) {
    this.state.component = index;
    this.model = this.models[index];
    if (index > 0 && !this.state.showPoints) {
      this.state.showPoints = true; // the mesh is of the main model
      this.toolbar.showState();
    }
    this.painter.setModel(this.model);
    this.toolbar.showComponent(index);
    this.tellCounts();
    this.choosePose(-1);
    this.setUp(this.up);
  }

  tellCounts() {
    const shown = this.model.positions.length / 3;
    const { images_refused: refused } = this.report.totals;
    this.message.textContent = [
      meshSentence(this.meshState, this.modelFile, this.mesh),
      `${plural(this.model.poses.length, 'camera')}, ${plural(shown, 'point')}${shown < this.model.pointsTotal ? ` of ${count(this.model.pointsTotal)} (thinned evenly for this page)` : ''}.`,
      refused > 0 ? `${plural(refused, 'refused image')} without a place here: see the table.` : '',
      document.body.dataset.renderer === '2d' ? 'This browser offers no WebGL, so a simpler drawing is shown.' : '',
      'Drag turns, right drag or two fingers move, the wheel zooms after a click, a click on a camera selects it.',
    ].filter(Boolean).join(' ');
  }

  setUp(up) {
    this.up = up;
    const direction = up === 'cameras' ? this.model.up : new Vector3(...up.split(',').map(Number));
    this.rotation.setFromUnitVectors(direction.clone().normalize(), Y_UP);
    this.resetView();
  }

  toStage(vector) {
    return vector.clone().applyQuaternion(this.rotation);
  }

  /** From behind the cameras, a little above; from a corner when they look in all directions. */
  resetView() {
    const forward = new Vector3();
    for (const pose of this.model.poses) forward.add(new Vector3(0, 0, 1).applyQuaternion(pose.rotation));
    forward.divideScalar(Math.max(1, this.model.poses.length)).applyQuaternion(this.rotation);
    forward.y = 0;
    const direction = forward.length() > 0.25 ? forward.normalize().negate().applyAxisAngle(Y_UP, 0.35) : new Vector3(0.6, 0, 0.8);
    direction.y = 0.42;
    const target = this.toStage(this.subject().center);
    this.setLens(FIELD_OF_VIEW_DEG);
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(direction.normalize(), this.fittingDistance(target, direction));
    this.controls.update();
    this.requestRender();
  }

  /** How far to stand back along `direction` so that the bulk of the points and all cameras are in the picture. */
  fittingDistance(target, direction) {
    const right = new Vector3().crossVectors(Y_UP, direction).normalize();
    const upward = new Vector3().crossVectors(direction, right);
    const tanY = Math.tan((FIELD_OF_VIEW_DEG * Math.PI) / 360) * FILLED;
    const tanX = tanY * this.camera.aspect;
    const needed = (world) => {
      const offset = this.toStage(world).sub(target);
      return offset.dot(direction) + Math.max(Math.abs(offset.dot(right)) / tanX, Math.abs(offset.dot(upward)) / tanY);
    };
    const points = samplePoints(this.subject(), FIT_SAMPLES).map(needed).sort((a, b) => a - b);
    const cameras = this.state.showCameras ? this.model.poses.map((pose) => needed(pose.center)) : [];
    return Math.max(points[Math.floor(FIT_QUANTILE * points.length)] ?? 0, ...cameras, 0.1 * this.model.radius);
  }

  setLens(fieldOfViewDeg) {
    this.camera.fov = fieldOfViewDeg;
    this.camera.near = this.model.radius * 0.003;
    this.camera.far = this.model.radius * 1000;
    this.camera.updateProjectionMatrix();
  }

  /** Stands where the selected camera stood; its frustum becomes the frame of the picture. */
  lookThrough() {
    const pose = this.model.poses[this.state.selected];
    const forward = this.toStage(new Vector3(0, 0, 1).applyQuaternion(pose.rotation));
    const depth = this.model.center.distanceTo(pose.center) || this.model.radius;
    const { left, right, top, bottom } = pose.extent;
    const tangent = Math.max(-top, bottom, Math.max(-left, right) / this.camera.aspect) / LOOK_THROUGH_FILLED;
    this.setLens((2 * Math.atan(tangent) * 180) / Math.PI);
    this.camera.position.copy(this.toStage(pose.center));
    this.controls.target.copy(this.toStage(pose.center)).addScaledVector(forward, depth);
    this.controls.update();
    this.requestRender();
  }

  choosePose(index) {
    this.state.selected = index;
    this.card.hidden = index < 0;
    this.card.replaceChildren();
    if (index >= 0) {
      const parts = buildCameraCard(this.model, index, this.report, {
        select: (pose) => this.choosePose(pose),
        lookThrough: () => this.lookThrough(),
        close: () => this.choosePose(-1),
      });
      this.card.append(...parts.flat().filter(Boolean));
      this.camera.updateMatrixWorld();
      this.card.classList.toggle('on-left', this.toStage(this.model.poses[index].center).project(this.camera).x > 0.4);
    }
    this.stateChanged();
  }

  /** Selects the camera of an image; false when it has none. */
  select(image) {
    for (let component = 0; component < this.models.length; ++component) {
      const pose = this.models[component].poses.findIndex((candidate) => candidate.image === image);
      if (pose < 0) continue;
      if (component !== this.state.component) this.setComponent(component);
      if (!this.state.showCameras) {
        this.state.showCameras = true;
        this.toolbar.showState();
      }
      this.choosePose(pose);
      return true;
    }
    return false;
  }

  /** The camera whose body is nearest to the pointer on the screen, or -1. */
  pick(event) {
    if (!this.state.showCameras) return -1;
    const box = this.canvas.getBoundingClientRect();
    let nearest = PICK_RADIUS_PX[event.pointerType] ?? PICK_RADIUS_PX.mouse;
    let found = -1;
    this.model.poses.forEach((pose, index) => {
      const body = new Vector3(0, 0, 0.6 * this.model.unit * this.state.cameraSize).applyQuaternion(pose.rotation).add(pose.center);
      const point = this.toStage(body).project(this.camera);
      if (point.z > 1) return;
      const x = box.left + (0.5 + 0.5 * point.x) * box.width;
      const y = box.top + (0.5 - 0.5 * point.y) * box.height;
      const distance = Math.hypot(event.clientX - x, event.clientY - y);
      if (distance < nearest) {
        nearest = distance;
        found = index;
      }
    });
    return found;
  }

  pointerDown(event) {
    this.pressed = { x: event.clientX, y: event.clientY };
    this.controls.enableZoom = true;
    this.canvas.focus({ preventScroll: true });
  }

  pointerUp(event) {
    const { pressed } = this;
    if (pressed && Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) < CLICK_TRAVEL_PX) {
      this.choosePose(this.pick(event));
    }
    this.pressed = null;
  }

  hover(event) {
    const pose = event.buttons === 0 ? this.pick(event) : -1;
    this.canvas.classList.toggle('picking', pose >= 0);
    if (pose < 0) {
      this.tooltip.hide();
      return;
    }
    const image = this.report.images[this.model.poses[pose].image];
    this.tooltip.show(event.clientX, event.clientY, image.name, `${plural(image.observations, 'observation')}, ${image.reprojection_rmse_px.toFixed(2)} px`);
  }

  keyDown(event) {
    const poses = this.model.poses.length;
    const actions = {
      ArrowLeft: () => this.turn(-KEY_TURN_RAD, 0),
      ArrowRight: () => this.turn(KEY_TURN_RAD, 0),
      ArrowUp: () => this.turn(0, -KEY_TURN_RAD),
      ArrowDown: () => this.turn(0, KEY_TURN_RAD),
      '+': () => this.zoom(1 / KEY_ZOOM),
      '=': () => this.zoom(1 / KEY_ZOOM),
      '-': () => this.zoom(KEY_ZOOM),
      '[': () => poses && this.choosePose((this.state.selected + poses - (this.state.selected < 0 ? 0 : 1)) % poses),
      ']': () => poses && this.choosePose((this.state.selected + 1) % poses),
      r: () => this.resetView(),
      Escape: () => this.choosePose(-1),
    };
    const action = event.ctrlKey || event.metaKey || event.altKey ? null : actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  turn(azimuth, polar) {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const spherical = new Spherical().setFromVector3(offset);
    spherical.theta += azimuth;
    spherical.phi += polar;
    this.camera.position.copy(this.controls.target).add(offset.setFromSpherical(spherical.makeSafe()));
    this.requestRender();
  }

  zoom(factor) {
    this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
    this.requestRender();
  }

  /** For tests: how many pixels of the canvas are not empty. */
  countDrawnPixels() {
    const copy = h('canvas', { width: this.canvas.width, height: this.canvas.height }).getContext('2d');
    copy.drawImage(this.canvas, 0, 0);
    const { data } = copy.getImageData(0, 0, this.canvas.width, this.canvas.height);
    let drawn = 0;
    for (let i = 3; i < data.length; i += 4) drawn += data[i] > 0 ? 1 : 0;
    return drawn;
  }
}

/** { element, start(), select(image) }. */
export function buildViewer(report, components, modelFile, tooltip) {
  const models = components.filter((component) => component.poses.length > 0).map((component) => buildModel(component, report));
  if (models.length > 0) return new Viewer(report, models, modelFile, tooltip);
  const element = section('view', 'Model', h('p', { class: 'empty' }, 'There is no model to show: no image could be registered. The table below tells why, image by image.'));
  document.body.dataset.renderer = 'none';
  return { element, start() {}, select: () => false };
}
