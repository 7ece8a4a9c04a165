// What fixed the unit of lengths: known lengths, what each says, and the markers that were measured.

import { h, section } from './dom.js';
import { count, DASH, fixed, plural, short, words } from './format.js';

const PERCENT = 100;

function table(label, titles, rows) {
  const head = titles.map((title, i) => h('th', { scope: 'col', class: i > 0 ? 'number' : null }, title));
  return h(
    'div',
    { class: 'table-frame', tabindex: 0, role: 'region', 'aria-label': label },
    h('table', { class: 'narrow' }, h('thead', null, h('tr', null, head)), h('tbody', null, rows)),
  );
}

function row(name, cells) {
  return h('tr', null, h('th', { scope: 'row' }, name), cells.map((cell) => h('td', { class: 'number' }, cell)));
}

function lengthsTable(scale) {
  if (scale.lengths.length === 0) return null;
  const metric = scale.unit === 'metre';
  const off = (length) => (metric ? `${fixed(PERCENT * (scale.metres_per_mapping_unit / length.metres_per_unit - 1), 2)} %` : DASH);
  return table(
    'Known lengths',
    ['Known length', 'Metres', 'In the model', 'Off by', 'Accuracy', 'Metres per unit of mapping'],
    scale.lengths.map((length) =>
      row(length.name, [
        short(length.known_m),
        metric ? `${fixed((length.known_m * scale.metres_per_mapping_unit) / length.metres_per_unit, 5)} m` : DASH,
        off(length),
        `${fixed(PERCENT * Math.hypot(length.sd_ratio, length.edge_sd_ratio), 2)} %`,
        String(length.metres_per_unit),
      ]),
    ),
  );
}

function markersTable(scale) {
  if (scale.markers.length === 0) return null;
  const cells = (marker) => [`${count(marker.views_used)} / ${count(marker.views_seen)}`, marker.outcome === 'ok' ? `${fixed(marker.rms_px, 3)} px` : DASH, words(marker.outcome)];
  return table('Markers', ['Marker', 'Images used / that see it', 'Corners, RMS', 'Outcome'], scale.markers.map((marker) => row(`${marker.id}`, cells(marker))));
}

function sentence(scale) {
  if (scale.unit !== 'metre') return `No scale: ${scale.problem}.`;
  const up = scale.up === 'card' ? ` Up is off the card, to ${fixed(scale.up_sd_deg, 2)}\u00b0.` : '';
  return `Lengths are in metres, from ${plural(scale.lengths.length, 'known length')}, to ${fixed(PERCENT * scale.sd_ratio, 2)} % (one standard deviation).${up}`;
}

/** A part for each model, when somebody knew a length. */
export function buildScale(report) {
  const scales = report.scale ?? [];
  if (scales.length === 0) return null;
  return section(
    'scale',
    'Scale',
    scales.map((scale, i) => [
      scales.length > 1 ? h('h3', null, `Model ${i + 1}`) : null,
      h('p', { class: 'muted' }, sentence(scale)),
      lengthsTable(scale),
      markersTable(scale),
    ]),
  );
}
