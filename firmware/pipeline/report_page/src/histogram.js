// Small bar plots in SVG.

import { h, s } from './dom.js';
import { count, plural, short } from './format.js';

const WIDTH = 360;
const HEIGHT = 190;
const TAIL_RATIO = 0.002;
const LEAST_BINS = 8;
const MARGIN = { left: 44, right: 10, top: 12, bottom: 36 };

/** Cuts the thin tail off the right end: the last bin that is left holds it too. */
function withoutTail(counts, total) {
  let rest = total;
  let length = 0;
  while (length < counts.length && (rest > TAIL_RATIO * total || length < LEAST_BINS)) rest -= counts[length++];
  const kept = counts.slice(0, length);
  kept[length - 1] += rest;
  return kept;
}

/** 1, 2 or 5 times a power of ten, at least `value`. */
function niceStep(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= value * 0.999);
}

function yAxis(highest, y) {
  const step = Math.max(1, niceStep(highest / 4));
  const ticks = [];
  for (let value = 0; value <= highest; value += step) {
    ticks.push(
      s('line', { class: 'grid', x1: MARGIN.left, x2: WIDTH - MARGIN.right, y1: y(value), y2: y(value) }),
      s('text', { class: 'tick', x: MARGIN.left - 6, y: y(value) + 4, 'text-anchor': 'end' }, value >= 10000 ? `${short(value / 1000)}k` : count(value)),
    );
  }
  return ticks;
}

/** Ticks at multiples of a nice step; bins of whole numbers carry theirs in the middle. */
function xAxis(plot, bins, x) {
  const { start, bin_width: width } = plot.histogram;
  const end = start + bins * width - (plot.integers ? width : 0);
  const step = niceStep((end - start) / 7);
  const ticks = [];
  for (let i = Math.ceil(start / step); i * step <= end + 1e-9; ++i) {
    const bin = (i * step - start) / width + (plot.integers ? 0.5 : 0);
    ticks.push(s('text', { class: 'tick', x: x(bin), y: HEIGHT - MARGIN.bottom + 15, 'text-anchor': 'middle' }, short(i * step)));
  }
  ticks.push(s('text', { class: 'axis', x: (MARGIN.left + WIDTH - MARGIN.right) / 2, y: HEIGHT - 4, 'text-anchor': 'middle' }, plot.axis));
  return ticks;
}

function binLabel(plot, bin, bins) {
  const { start, bin_width: width } = plot.histogram;
  const low = start + bin * width;
  if (bin === bins - 1) return `${short(low)} ${plot.unit} and more`;
  return plot.integers ? `${short(low)} ${plot.unit}` : `${short(low)} to ${short(low + width)} ${plot.unit}`;
}

function marker(plot, bins, x) {
  if (!Number.isFinite(plot.marker?.value)) return null;
  const at = x((plot.marker.value - plot.histogram.start) / plot.histogram.bin_width);
  if (at > x(bins)) return null;
  const late = at > 0.75 * WIDTH;
  return [
    s('line', { class: 'marker', x1: at, x2: at, y1: MARGIN.top, y2: HEIGHT - MARGIN.bottom }),
    s('text', { class: 'marker-text', x: late ? at - 5 : at + 5, y: MARGIN.top + 9, 'text-anchor': late ? 'end' : 'start' }, plot.marker.text),
  ];
}

/**
 * plot: { title, histogram: { start, bin_width, counts }, axis, unit, integers: whether bins are whole numbers,
 * things: what is counted, marker: { value, text } or none }.
 */
export function buildHistogram(plot, tooltip) {
  const total = plot.histogram.counts.reduce((sum, value) => sum + value, 0);
  if (total === 0) {
    return h('figure', { class: 'plot' }, h('figcaption', null, plot.title), h('p', { class: 'empty' }, 'Nothing to show.'));
  }
  const counts = withoutTail(plot.histogram.counts, total);
  const bins = counts.length;
  const highest = Math.max(...counts);
  const x = (bin) => MARGIN.left + (bin / bins) * (WIDTH - MARGIN.left - MARGIN.right);
  const y = (value) => HEIGHT - MARGIN.bottom - (value / highest) * (HEIGHT - MARGIN.top - MARGIN.bottom);
  const bars = counts.map((value, bin) => {
    const show = (event) => tooltip.show(event.clientX, event.clientY, binLabel(plot, bin, bins), `${plural(value, plot.things.slice(0, -1), plot.things)}, ${((100 * value) / total).toFixed(1)} %`);
    return s(
      'g',
      { class: 'bar', onpointermove: show, onpointerleave: () => tooltip.hide() },
      s('rect', { class: 'bar-area', x: x(bin), y: MARGIN.top, width: x(bin + 1) - x(bin), height: HEIGHT - MARGIN.top - MARGIN.bottom }),
      s('rect', { class: 'bar-fill', x: x(bin) + 0.5, y: y(value), width: Math.max(1, x(bin + 1) - x(bin) - 1), height: y(0) - y(value), rx: 1 }),
    );
  });
  const mode = counts.indexOf(highest);
  const label = `${plot.title}: ${count(total)} ${plot.things}, most frequent ${binLabel(plot, mode, bins)}`;
  return h(
    'figure',
    { class: 'plot' },
    h('figcaption', null, plot.title),
    s('svg', { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: 'img', 'aria-label': label }, yAxis(highest, y), bars, xAxis(plot, bins, x), marker(plot, bins, x)),
  );
}
