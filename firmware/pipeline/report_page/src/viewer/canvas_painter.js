// Draws the model without WebGL: points through a depth buffer into an image, lines over it.

import { Matrix4 } from 'three';

import { buildLines, seenMask } from './model.js';

const LARGEST_RATIO = 1.5; // pixels are filled one by one here
const DIMMED = 0.75;
const HIGHLIGHTED = 0.4;

function packed(red, green, blue) {
  return (255 << 24) | (blue << 16) | (green << 8) | red; // little-endian RGBA
}

function css(colors, at) {
  const channel = (i) => Math.round(255 * colors[at + i]);
  return `rgba(${channel(0)}, ${channel(1)}, ${channel(2)}, ${colors[at + 3].toFixed(2)})`;
}

export class CanvasPainter {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d');
    this.ratio = 1;
  }

  setModel(model) {
    this.model = model;
  }

  setState(state, palette) {
    this.state = state;
    this.palette = palette;
    this.seen = seenMask(this.model, state);
    this.lines = buildLines(this.model, state, palette);
  }

  resize(width, height, ratio) {
    this.ratio = Math.min(ratio, LARGEST_RATIO);
    this.canvas.width = Math.max(1, Math.round(width * this.ratio));
    this.canvas.height = Math.max(1, Math.round(height * this.ratio));
  }

  render(camera, rotation) {
    camera.updateMatrixWorld();
    const matrix = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).multiply(new Matrix4().makeRotationFromQuaternion(rotation));
    this.context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    if (this.state.showPoints) this.drawPoints(matrix.elements, camera.near);
    this.drawLines(matrix.elements, camera.near);
  }

  /** Pixel and depth of a world point into `out`; false when it lies before the near plane. */
  project(e, positions, at, near, out) {
    const x = positions[at];
    const y = positions[at + 1];
    const z = positions[at + 2];
    const w = e[3] * x + e[7] * y + e[11] * z + e[15];
    if (w < near) return false;
    out[0] = (0.5 + (0.5 * (e[0] * x + e[4] * y + e[8] * z + e[12])) / w) * this.canvas.width;
    out[1] = (0.5 - (0.5 * (e[1] * x + e[5] * y + e[9] * z + e[13])) / w) * this.canvas.height;
    out[2] = w;
    return true;
  }

  pointColor(point) {
    const { colors } = this.model;
    const [red, green, blue] = [colors[3 * point], colors[3 * point + 1], colors[3 * point + 2]];
    if (this.state.selected < 0) return packed(red, green, blue);
    const [other, share] = this.seen[point] ? [this.palette.selected, HIGHLIGHTED] : [this.palette.background, DIMMED];
    const mix = (value, i) => Math.round(value + share * (255 * other[i] - value));
    return packed(mix(red, 0), mix(green, 1), mix(blue, 2));
  }

  drawPoints(matrix, near) {
    const { width, height } = this.canvas;
    const image = this.context.createImageData(width, height);
    const pixels = new Uint32Array(image.data.buffer);
    const depth = new Float32Array(pixels.length).fill(Infinity);
    const at = [0, 0, 0];
    const { positions } = this.model;
    for (let point = 0; 3 * point < positions.length; ++point) {
      if (!this.project(matrix, positions, 3 * point, near, at)) continue;
      const strong = this.state.selected >= 0 && this.seen[point] === 1;
      const size = Math.max(1, Math.round(this.state.pointSize * this.ratio * (strong ? 1.7 : 1)));
      const left = Math.round(at[0] - size / 2);
      const top = Math.round(at[1] - size / 2);
      const color = this.pointColor(point);
      for (let row = Math.max(0, top); row < Math.min(height, top + size); ++row) {
        for (let column = Math.max(0, left); column < Math.min(width, left + size); ++column) {
          const pixel = row * width + column;
          if (at[2] < depth[pixel]) {
            depth[pixel] = at[2];
            pixels[pixel] = color;
          }
        }
      }
    }
    this.context.putImageData(image, 0, 0);
  }

  drawLines(matrix, near) {
    const { positions, colors } = this.lines;
    const from = [0, 0, 0];
    const to = [0, 0, 0];
    this.context.lineWidth = this.ratio;
    for (let line = 0; 6 * line < positions.length; ++line) {
      if (!this.project(matrix, positions, 6 * line, near, from) || !this.project(matrix, positions, 6 * line + 3, near, to)) continue;
      this.context.strokeStyle = css(colors, 8 * line);
      this.context.beginPath();
      this.context.moveTo(from[0], from[1]);
      this.context.lineTo(to[0], to[1]);
      this.context.stroke();
    }
  }
}
