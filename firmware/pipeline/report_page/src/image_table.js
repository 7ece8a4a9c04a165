// The table of all images; refused ones first, with reason and advice.

import { h, section } from './dom.js';
import { count, fixed, plural, words } from './format.js';

const COLUMNS = [
  { title: 'Image', key: (image) => image.name },
  { title: 'Status', key: (image) => rank(image) },
  { title: 'Features', key: (image) => image.features, number: true },
  { title: 'Overlapping images', key: (image) => image.overlapping_images, number: true },
  { title: 'Map matches', key: (image) => image.map_matches, number: true },
  { title: 'Agreeing', key: (image) => image.map_inliers, number: true },
  { title: 'Observations', key: (image) => image.observations, number: true },
  { title: 'Error RMS, px', key: (image) => image.reprojection_rmse_px, number: true },
];

/** Refused images come before separate models, these before the main model. */
function rank(image) {
  if (image.component === null) return 0;
  return image.component > 0 ? 1 : 2;
}

function statusCell(image) {
  const state = ['refused', 'apart', 'registered'][rank(image)];
  const word = image.status === 'registered' && image.component > 0 ? `model ${image.component + 1}` : words(image.status);
  return h('td', null, h('span', { class: `badge status-${state}` }, word));
}

function nameCell(image, onSelect) {
  const name = image.component === null ? h('span', { class: 'name' }, image.name) : h('button', { class: 'link name', type: 'button', title: 'Show in 3D', onclick: onSelect }, image.name);
  return h(
    'th',
    { scope: 'row' },
    name,
    image.detail ? h('p', { class: 'detail' }, image.detail) : null,
    image.advice ? h('p', { class: 'advice' }, image.advice) : null,
  );
}

function row(image, position, onSelect) {
  const hasPose = image.component !== null;
  return h(
    'tr',
    { 'data-image': position, class: hasPose ? null : 'refused' },
    nameCell(image, () => onSelect(position)),
    statusCell(image),
    h('td', { class: 'number' }, count(image.features)),
    h('td', { class: 'number' }, count(image.overlapping_images)),
    h('td', { class: 'number' }, count(image.map_matches)),
    h('td', { class: 'number' }, count(image.map_inliers)),
    h('td', { class: 'number' }, count(hasPose ? image.observations : null)),
    h('td', { class: 'number' }, fixed(hasPose ? image.reprojection_rmse_px : NaN, 2)),
  );
}

function compare(a, b) {
  return typeof a === 'string' ? a.localeCompare(b, 'en', { numeric: true }) : (a ?? -Infinity) - (b ?? -Infinity);
}

/** Head cells that sort on click; aria-sort tells which and how. */
function buildHead(sortBy) {
  const cells = COLUMNS.map((column, i) => h('th', { scope: 'col', class: column.number ? 'number' : null, 'aria-sort': 'none' }, h('button', { type: 'button', class: 'sort', onclick: () => sortBy(i) }, column.title)));
  return { element: h('thead', null, h('tr', null, cells)), cells };
}

export function buildImageTable(report, onSelect) {
  const rows = report.images.map((image, position) => ({ image, position, element: row(image, position, onSelect) }));
  const body = h('tbody', null);
  let sortedColumn = 1;
  let direction = 1;
  const place = () => {
    const { key } = COLUMNS[sortedColumn];
    rows.sort((a, b) => direction * compare(key(a.image), key(b.image)) || a.position - b.position);
    body.replaceChildren(...rows.map((entry) => entry.element));
    head.cells.forEach((cell, i) => cell.setAttribute('aria-sort', i !== sortedColumn ? 'none' : direction > 0 ? 'ascending' : 'descending'));
  };
  const head = buildHead((column) => {
    direction = column === sortedColumn ? -direction : 1;
    sortedColumn = column;
    place();
  });
  place();
  if (report.images.length === 0) return null;
  const refused = report.totals.images_refused;
  return section(
    'images',
    'Images',
    h('p', { class: 'muted' }, `${plural(report.images.length, 'image')}${refused ? `, ${count(refused)} refused and listed first` : ''}. A click on a title sorts, a click on a name shows the camera in 3D.`),
    h('div', { class: 'table-frame tall', tabindex: 0, role: 'region', 'aria-label': 'Images' }, h('table', { id: 'image-table', class: report.totals.images_refused > 0 ? 'with-refused' : null }, head.element, body)),
  );
}
