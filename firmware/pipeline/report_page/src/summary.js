// The top of the page: verdict, remarks, numbers.

import { h, section } from './dom.js';
import { count, DASH, fixed, plural, words } from './format.js';

const VERDICT_WORDS = { complete: 'complete', partial: 'partial', not_ready: 'not ready' };

export function buildHeader(report) {
  return h(
    'header',
    { class: `verdict verdict-${report.verdict}` },
    h('p', { class: 'eyebrow' }, 'Reconstruction report'),
    h('h1', null, report.input || 'Reconstruction'),
    h(
      'p',
      { class: 'verdict-line' },
      h('span', { class: 'badge' }, VERDICT_WORDS[report.verdict] ?? report.verdict),
      h('span', { id: 'verdict' }, report.verdict_sentence),
    ),
    h('p', { class: 'muted' }, report.units),
  );
}

export function buildNotes(notes) {
  if (notes.length === 0) return null;
  return h(
    'ul',
    { class: 'notes', 'aria-label': 'Remarks' },
    notes.map((note) =>
      h('li', { class: `note note-${note.severity}` }, h('span', { class: 'badge' }, note.severity), h('span', null, note.text)),
    ),
  );
}

function card(value, label, hint) {
  return h('div', { class: 'card' }, h('dt', null, label), h('dd', null, value), h('dd', { class: 'hint' }, hint));
}

export function buildCards(report) {
  const totals = report.totals;
  const measured = totals.observations > 0;
  const cameras = new Set(report.cameras.map((camera) => camera.group)).size;
  return h(
    'dl',
    { class: 'cards', 'aria-label': 'Numbers' },
    card(
      `${count(totals.images_registered)} / ${count(totals.images)}`,
      'Images registered',
      totals.images_refused > 0 ? `${count(totals.images_refused)} refused` : 'none refused',
    ),
    card(count(totals.points), 'Points', `${count(totals.observations)} observations`),
    card(
      measured ? `${fixed(totals.reprojection_rmse_px, 2)} px` : DASH,
      'Reprojection error, RMS',
      measured ? `median ${fixed(totals.reprojection_median_px, 2)} px, mean ${fixed(totals.reprojection_mean_px, 2)} px` : 'nothing measured',
    ),
    card(measured ? fixed(totals.mean_track_length, 1) : DASH, 'Images per point', 'mean track length'),
    card(count(totals.components), totals.components === 1 ? 'Model' : 'Models', modelsHint(totals)),
    card(count(cameras), cameras === 1 ? 'Camera' : 'Cameras', camerasHint(report.cameras)),
  );
}

function modelsHint(totals) {
  if (totals.components === 0) return 'nothing could be linked';
  if (totals.components === 1) return 'everything linked';
  return `${plural(totals.images_in_other_components, 'image')} not in the main one`;
}

const ORIGIN_WORDS = { given: 'given', prior_refined: 'EXIF prior, refined', solved: 'solved' };

function camerasHint(cameras) {
  if (cameras.length === 0) return 'no intrinsics';
  const origins = [...new Set(cameras.map((camera) => ORIGIN_WORDS[camera.origin] ?? camera.origin))];
  return `intrinsics ${origins.join(', ')}`;
}

function cameraRow(camera, severalComponents) {
  const distortion = Object.entries(camera.distortion)
    .map(([name, value]) => `${name} ${fixed(value, 5)}`)
    .join('  ');
  return h(
    'tr',
    null,
    h('th', { scope: 'row' }, severalComponents ? `${camera.group + 1} in model ${camera.component + 1}` : `${camera.group + 1}`),
    h('td', { class: 'number' }, count(camera.images)),
    h('td', { class: 'size' }, `${camera.width_px} \u00d7 ${camera.height_px}`),
    h('td', { class: 'number' }, `${fixed(camera.fx_px, 1)} / ${fixed(camera.fy_px, 1)}`),
    h('td', { class: 'number' }, `${fixed(camera.cx_px, 1)} / ${fixed(camera.cy_px, 1)}`),
    h('td', { class: 'number' }, `${fixed(camera.focal_35mm_equivalent_mm, 1)} mm`),
    h('td', { class: 'number' }, `${fixed(camera.horizontal_fov_deg, 1)}\u00b0`),
    h('td', null, words(camera.model), distortion ? h('div', { class: 'hint' }, distortion) : null),
    h('td', null, ORIGIN_WORDS[camera.origin] ?? camera.origin),
  );
}

export function buildCameras(report) {
  if (report.cameras.length === 0) return null;
  const several = report.totals.components > 1;
  const titles = ['Group', 'Images', 'Size, px', 'Focal x / y, px', 'Centre x / y, px', '35 mm equivalent', 'Field of view', 'Lens model', 'Intrinsics'];
  const numeric = new Set([1, 3, 4, 5, 6]);
  return section(
    'cameras',
    'Cameras',
    h(
      'div',
      { class: 'table-frame', tabindex: 0, role: 'region', 'aria-label': 'Camera groups' },
      h(
        'table',
        null,
        h('thead', null, h('tr', null, titles.map((title, i) => h('th', { scope: 'col', class: numeric.has(i) ? 'number' : null }, title)))),
        h('tbody', null, report.cameras.map((camera) => cameraRow(camera, several))),
      ),
    ),
    h('p', { class: 'hint' }, 'The centre of the first pixel is (0, 0). The 35 mm equivalent is by the diagonal of the frame.'),
  );
}

export function buildSettings(report) {
  return section(
    'settings',
    'Settings',
    report.settings.length === 0
      ? h('p', { class: 'muted' }, 'None recorded.')
      : h(
          'dl',
          { class: 'settings' },
          report.settings.map((setting) => h('div', null, h('dt', null, setting.name), h('dd', null, setting.value))),
        ),
  );
}
