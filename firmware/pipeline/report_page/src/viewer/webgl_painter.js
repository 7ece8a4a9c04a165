// Draws the model with WebGL through three.js.

import { BufferAttribute, BufferGeometry, Color, Group, LineSegments, Points, Scene, ShaderMaterial, WebGLRenderer } from 'three';

import { buildLines, seenMask } from './model.js';

const POINT_VERTEX = `
attribute float seen;
uniform float size;
uniform bool selecting;
uniform vec3 background;
uniform vec3 highlight;
attribute vec3 rgb;
varying vec3 tint;
void main() {
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  bool strong = selecting && seen > 0.5;
  gl_PointSize = size * (strong ? 1.7 : 1.0);
  tint = selecting ? (strong ? mix(rgb, highlight, 0.4) : mix(rgb, background, 0.75)) : rgb;
}`;

const POINT_FRAGMENT = `
varying vec3 tint;
void main() {
  vec2 fromCenter = gl_PointCoord - 0.5;
  if (dot(fromCenter, fromCenter) > 0.25) discard;
  gl_FragColor = vec4(tint, 1.0);
}`;

const LINE_VERTEX = `
attribute vec4 rgba;
varying vec4 tint;
void main() {
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  tint = rgba;
}`;

const LINE_FRAGMENT = `
varying vec4 tint;
void main() {
  gl_FragColor = tint;
}`;

/** Whether this browser draws with WebGL 2 here and now. */
export function webglWorks() {
  try {
    const context = document.createElement('canvas').getContext('webgl2');
    context?.getExtension('WEBGL_lose_context')?.loseContext();
    return context !== null;
  } catch {
    return false;
  }
}

function geometryOf(attributes) {
  const geometry = new BufferGeometry();
  for (const [name, [array, itemSize, normalized]] of Object.entries(attributes)) {
    geometry.setAttribute(name, new BufferAttribute(array, itemSize, normalized));
  }
  return geometry;
}

export class WebglPainter {
  constructor(canvas) {
    // The buffer is kept for printing and for the page's own check.
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.ratio = 1;
    this.scene = new Scene();
    this.root = new Group();
    this.scene.add(this.root);
    this.pointMaterial = new ShaderMaterial({
      vertexShader: POINT_VERTEX,
      fragmentShader: POINT_FRAGMENT,
      uniforms: { size: { value: 2 }, selecting: { value: false }, background: { value: new Color() }, highlight: { value: new Color() } },
    });
    this.lineMaterial = new ShaderMaterial({ vertexShader: LINE_VERTEX, fragmentShader: LINE_FRAGMENT, transparent: true, depthWrite: false });
  }

  setModel(model) {
    this.points?.geometry.dispose();
    this.root.clear();
    this.model = model;
    const seen = new Uint8Array(model.positions.length / 3);
    this.points = new Points(geometryOf({ position: [model.positions, 3], rgb: [model.colors, 3, true], seen: [seen, 1] }), this.pointMaterial);
    this.lines = new LineSegments(new BufferGeometry(), this.lineMaterial);
    if (this.mesh) this.root.add(this.mesh);
    for (const object of [this.points, this.lines]) {
      object.frustumCulled = false;
      this.root.add(object);
    }
  }

  /** An object in the world of the model, drawn while state.showMesh is set and its component is shown. */
  setMesh(mesh) {
    this.mesh = mesh;
    this.root.add(mesh);
  }

  setState(state, palette) {
    const { size, selecting, background, highlight } = this.pointMaterial.uniforms;
    size.value = state.pointSize * this.ratio;
    selecting.value = state.selected >= 0;
    background.value.fromArray(palette.background);
    highlight.value.fromArray(palette.selected);
    this.points.visible = state.showPoints;
    if (this.mesh) this.mesh.visible = state.showMesh && state.component === 0;
    this.points.geometry.setAttribute('seen', new BufferAttribute(seenMask(this.model, state), 1));
    const { positions, colors } = buildLines(this.model, state, palette);
    this.lines.geometry.dispose();
    this.lines.geometry = geometryOf({ position: [positions, 3], rgba: [colors, 4] });
  }

  resize(width, height, ratio) {
    this.ratio = ratio;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
  }

  render(camera, rotation) {
    this.root.quaternion.copy(rotation);
    this.renderer.render(this.scene, camera);
  }
}
