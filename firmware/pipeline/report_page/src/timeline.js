// The frames of a video in order of time: what became of each, how sharp it was, how its mapping kept up.

import { h, s, section } from './dom.js';
import { count, fixed, plural } from './format.js';

const WIDTH = 1000;
const HEIGHT = 150;
const ROW_HEIGHT = 44;
const MARGIN = { left: 8, right: 8, top: 8, bottom: 26 };
const KEPT = 'kept';
// In the order of the legend; the class names of styles.css.
const VERDICTS = [KEPT, 'too little motion', 'blurred', 'over budget', 'too fast', 'exposure jump', 'duplicate', 'track lost'];

const classOf = (verdict) => `frame-${verdict.replaceAll(' ', '-')}`;

function describe(frame) {
  const numbers = `sharpness ${fixed(frame.relative_sharpness, 2)} of what is usual, motion ${fixed(frame.motion_deg, 1)}\u00b0, overlap ${fixed(100 * frame.overlap, 0)} %`;
  return [`${frame.name}, ${fixed(frame.time_s, 2)} s: ${frame.verdict}`, numbers];
}

function legend(frames) {
  const used = VERDICTS.filter((verdict) => frames.some((frame) => frame.verdict === verdict));
  return h(
    'ul',
    { class: 'legend' },
    used.map((verdict) => h('li', null, h('span', { class: `swatch ${classOf(verdict)}` }), `${verdict} ${count(frames.filter((frame) => frame.verdict === verdict).length)}`)),
  );
}

function timeAxis(end, x) {
  const step = [1, 2, 5, 10, 20, 30, 60, 120, 300, 600].find((seconds) => end / seconds <= 12) ?? 3600;
  const ticks = [];
  for (let time = 0; time <= end; time += step) {
    ticks.push(s('text', { class: 'tick', x: x(time), y: HEIGHT - 8, 'text-anchor': time === 0 ? 'start' : 'middle' }, `${time} s`));
  }
  return ticks;
}

/** A row under the frames: one value of each frame that was mapped while it was captured; null when there is none. */
function liveRow(frames, x, { title, unit, digits, valueOf }, tooltip) {
  const mapped = frames.filter((frame) => frame.live);
  if (mapped.length === 0) return null;
  const most = Math.max(...mapped.map(valueOf));
  const scale = most > 0 ? (ROW_HEIGHT - 4) / most : 0;
  const marks = mapped.map((frame) => {
    const height = Math.max(1, valueOf(frame) * scale);
    const text = `${frame.name}, ${fixed(frame.time_s, 2)} s: ${frame.live.following}`;
    const show = (event) => tooltip.show(event.clientX, event.clientY, text, `${title} ${fixed(valueOf(frame), digits)}${unit}`);
    return s('rect', { class: `live live-${frame.live.following}`, x: x(frame.time_s) - 2, width: 4, y: ROW_HEIGHT - height, height, onpointermove: show, onpointerleave: () => tooltip.hide() });
  });
  return h(
    'figure',
    { class: 'plot timeline' },
    h('figcaption', null, `${title}, at most ${fixed(most, digits)}${unit}`),
    s('svg', { viewBox: `0 0 ${WIDTH} ${ROW_HEIGHT}`, role: 'img', 'aria-label': `${title}, at most ${fixed(most, digits)}${unit}` }, marks),
  );
}

const LIVE_ROWS = [
  { title: 'Mapping of each keyframe while it was captured', unit: ' ms', digits: 0, valueOf: (frame) => 1000 * frame.live.seconds },
  { title: 'Keyframes that waited to be mapped', unit: '', digits: 0, valueOf: (frame) => frame.live.waiting },
];

/** Null when the input was no video. */
export function buildTimeline(report, tooltip) {
  const frames = report.frames ?? [];
  if (frames.length === 0) return null;
  const end = Math.max(frames.at(-1).time_s, 0.001);
  const sharpest = Math.max(...frames.map((frame) => frame.relative_sharpness), 0.001);
  const x = (time) => MARGIN.left + (time / end) * (WIDTH - MARGIN.left - MARGIN.right);
  const floor = HEIGHT - MARGIN.bottom;
  const width = Math.max(1, (0.8 * (WIDTH - MARGIN.left - MARGIN.right)) / frames.length);
  const bars = frames.map((frame) => {
    const height = Math.max(2, (frame.relative_sharpness / sharpest) * (floor - MARGIN.top));
    const show = (event) => tooltip.show(event.clientX, event.clientY, ...describe(frame));
    return s('rect', { class: `frame ${classOf(frame.verdict)}`, x: x(frame.time_s) - width / 2, width, y: floor - height, height, onpointermove: show, onpointerleave: () => tooltip.hide() });
  });
  const kept = frames.filter((frame) => frame.verdict === KEPT).length;
  return section(
    'frames',
    'Video',
    h(
      'figure',
      { class: 'plot timeline' },
      h('figcaption', null, `${count(kept)} of ${plural(frames.length, 'frame')} kept; the height of a bar is the sharpness of its frame`),
      s('svg', { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: 'img', 'aria-label': `${count(kept)} of ${count(frames.length)} frames of the video kept` }, bars, timeAxis(end, x)),
      legend(frames),
    ),
    LIVE_ROWS.map((row) => liveRow(frames, x, row, tooltip)),
  );
}
