// The match graph as a square: row and column are images, a cell tells how many matches agree with one geometry.

import { h, section } from './dom.js';
import { baseName, count, plural, words } from './format.js';

const LARGEST_PX = 640;
const LABEL_CELL_PX = 30;
const WEAKEST_SHOWN = 8;

/** Colours by kind; general pairs are shaded by the count instead. */
const KIND_COLORS = { planar: '--kind-planar', pure_rotation: '--kind-rotation', watermark: '--kind-watermark', duplicate: '--kind-duplicate' };

function pairTable(report) {
  const size = report.images.length;
  const table = new Map();
  for (const pair of report.pairs) {
    table.set(pair.first * size + pair.second, pair);
    table.set(pair.second * size + pair.first, pair);
  }
  return (row, column) => table.get(row * size + column);
}

function shade(pair, most, colors) {
  if (!pair || pair.inliers === 0 || pair.kind === 'none') return null;
  const strength = 0.15 + (0.85 * Math.log1p(pair.inliers)) / Math.log1p(most);
  return { color: colors[pair.kind] ?? colors.general, strength };
}

function readColors() {
  const style = getComputedStyle(document.documentElement);
  const colors = { general: style.getPropertyValue('--accent'), grid: style.getPropertyValue('--line'), text: style.getPropertyValue('--text') };
  for (const [kind, name] of Object.entries(KIND_COLORS)) colors[kind] = style.getPropertyValue(name);
  return colors;
}

function drawCells(context, matrix, cell) {
  const { size, pairAt, most } = matrix;
  const colors = readColors();
  context.font = `${Math.min(12, cell / 3)}px system-ui, sans-serif`;
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  for (let row = 0; row < size; ++row) {
    context.globalAlpha = 1;
    context.fillStyle = colors.grid;
    context.fillRect(row * cell, row * cell, cell, cell);
    for (let column = 0; column < size; ++column) {
      const pair = pairAt(row, column);
      const look = shade(pair, most, colors);
      if (!look) continue;
      const gap = cell > 6 ? 1 : 0;
      context.globalAlpha = look.strength;
      context.fillStyle = look.color;
      context.fillRect(column * cell + gap / 2, row * cell + gap / 2, cell - gap, cell - gap);
      if (cell >= LABEL_CELL_PX) {
        context.globalAlpha = 1;
        context.fillStyle = look.strength > 0.62 ? '#fff' : colors.text;
        context.fillText(pair.inliers, (column + 0.5) * cell, (row + 0.5) * cell);
      }
    }
  }
  context.globalAlpha = 1;
}

function drawCursor(context, matrix, cell) {
  const { cursor } = matrix;
  if (!cursor) return;
  context.strokeStyle = readColors().text;
  context.lineWidth = 2;
  context.strokeRect(cursor.column * cell + 1, cursor.row * cell + 1, Math.max(2, cell - 2), Math.max(2, cell - 2));
}

function describe(matrix, row, column) {
  const { images } = matrix.report;
  if (row === column) return [images[row].name, words(images[row].status)];
  const pair = matrix.pairAt(row, column);
  const title = `${baseName(images[row].name)}  \u2194  ${baseName(images[column].name)}`;
  if (!pair) return [title, 'not tried, or nothing in common'];
  return [title, `${words(pair.kind)}: ${count(pair.inliers)} of ${plural(pair.candidates, 'match', 'matches')} agree`];
}

function buildLegend(report) {
  const kinds = new Set(report.pairs.map((pair) => pair.kind));
  const entries = [['general', '--accent'], ...Object.entries(KIND_COLORS)].filter(([kind]) => kinds.has(kind));
  return h('ul', { class: 'legend' }, entries.map(([kind]) => h('li', null, h('span', { class: `swatch swatch-${kind}` }), words(kind))), h('li', { class: 'muted' }, 'darker: more agreeing matches'));
}

/** Arrow keys walk over the cells; the text below says what the cell holds. */
function onKey(event, matrix, redraw) {
  const steps = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] };
  const step = steps[event.key];
  if (!step) return;
  event.preventDefault();
  const cursor = matrix.cursor ?? { row: 0, column: 0 };
  const clamp = (value) => Math.max(0, Math.min(matrix.size - 1, value));
  matrix.cursor = { row: clamp(cursor.row + step[0]), column: clamp(cursor.column + step[1]) };
  redraw();
}

function strongestPair(report) {
  return report.pairs.reduce((most, pair) => Math.max(most, pair.inliers), 1);
}

/** The images that hang on the fewest agreeing matches: where one more photograph helps most. */
function buildWeakest(report, onSelect) {
  const sums = report.images.map((image, position) => ({ image, position, inliers: 0, pairs: 0 }));
  for (const pair of report.pairs) {
    if (pair.kind === 'none') continue;
    for (const position of [pair.first, pair.second]) {
      sums[position].inliers += pair.inliers;
      sums[position].pairs += 1;
    }
  }
  sums.sort((a, b) => a.inliers - b.inliers || a.position - b.position);
  const entry = ({ image, position, inliers, pairs }) => {
    const label = baseName(image.name);
    const name = image.component === null ? h('span', null, label) : h('button', { type: 'button', class: 'link', onclick: () => onSelect(position) }, label);
    return h('li', null, name, h('div', { class: 'hint' }, `${plural(inliers, 'agreeing match', 'agreeing matches')} in ${plural(pairs, 'pair')}`));
  };
  return h('div', { class: 'weakest' }, h('h3', null, 'Weakest links'), h('p', { class: 'hint' }, 'Images with the fewest agreeing matches; another photograph near one of them strengthens the model.'), h('ol', null, sums.slice(0, WEAKEST_SHOWN).map(entry)));
}

export function buildMatchMatrix(report, tooltip, onSelect) {
  if (report.pairs.length === 0) return null;
  const matrix = { report, size: report.images.length, pairAt: pairTable(report), most: strongestPair(report), cursor: null };
  const linked = report.pairs.filter((pair) => pair.inliers > 0 && pair.kind !== 'none').length;
  const summary = `${plural(linked, 'pair')} of images with agreeing matches`;
  const readout = h('p', { class: 'hint', 'aria-live': 'polite' }, 'Point at a cell, or use the arrow keys.');
  const canvas = h('canvas', { class: 'matrix', tabindex: 0, role: 'img', 'aria-label': `Match graph: ${summary}. Arrow keys read the cells.` });
  const context = canvas.getContext('2d');

  const redraw = () => {
    const side = Math.max(80, Math.min(LARGEST_PX, canvas.parentElement?.clientWidth || LARGEST_PX, matrix.size * 44));
    const ratio = window.devicePixelRatio || 1;
    canvas.width = canvas.height = Math.round(side * ratio);
    canvas.style.width = canvas.style.height = `${side}px`;
    const cell = canvas.width / matrix.size / ratio;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    drawCells(context, matrix, cell);
    drawCursor(context, matrix, cell);
    if (matrix.cursor) readout.textContent = describe(matrix, matrix.cursor.row, matrix.cursor.column).join(': ');
  };
  const cellAt = (event) => {
    const box = canvas.getBoundingClientRect();
    const at = (value, start, length) => Math.max(0, Math.min(matrix.size - 1, Math.floor(((value - start) / length) * matrix.size)));
    return { row: at(event.clientY, box.top, box.height), column: at(event.clientX, box.left, box.width) };
  };
  canvas.addEventListener('pointermove', (event) => {
    const { row, column } = cellAt(event);
    tooltip.show(event.clientX, event.clientY, ...describe(matrix, row, column));
  });
  canvas.addEventListener('pointerleave', () => tooltip.hide());
  canvas.addEventListener('click', (event) => onSelect(cellAt(event).row));
  canvas.addEventListener('keydown', (event) => onKey(event, matrix, redraw));
  const element = section('matches', 'Match graph', h('p', { class: 'muted' }, `${summary}; rows and columns are the images in their order.`), buildLegend(report), h('div', { class: 'matrix-columns' }, h('div', null, h('div', { class: 'matrix-frame' }, canvas), readout), buildWeakest(report, onSelect)));
  return { element, redraw };
}
