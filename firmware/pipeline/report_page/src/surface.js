// What the stages after mapping came to: depth maps, surface, texture. Sections appear when there is something to tell.

import { h, section } from './dom.js';
import { count, DASH, fixed, plural, short } from './format.js';

const METRE_DIGITS = 3;

function percent(ratio) {
  return Number.isFinite(ratio) ? `${(100 * ratio).toFixed(1)} %` : DASH;
}

/** Lengths and areas in metres when the scale is known. */
function measures(report) {
  const scale = report.metres_per_unit;
  const metric = Number.isFinite(scale);
  return {
    length: (value) => (metric ? `${fixed(value * scale, METRE_DIGITS)} m` : `${short(value)} units`),
    area: (value) => (metric ? `${short(value * scale * scale)} m\u00b2` : `${short(value)} units\u00b2`),
  };
}

function card(value, label, hint) {
  return h('div', { class: 'card' }, h('dt', null, label), h('dd', null, value), h('dd', { class: 'hint' }, hint));
}

function denseCards(dense) {
  if (!dense) return [];
  return [
    card(count(dense.points), 'Dense points', `${fixed(dense.mean_view_count, 1)} views agree on one`),
    card(count(dense.views), 'Depth maps', `${dense.map_width_px} \u00d7 ${dense.map_height_px} px, ${percent(dense.filled_ratio)} filled`),
  ];
}

function movingCards(moving) {
  if (!moving) return [];
  const hint = moving.images.length === 0 ? 'nothing moved that could be found' : `${percent(moving.masked_ratio)} of all pixels left out, see masks/`;
  return [card(count(moving.images.length), 'Photographs with motion', hint)];
}

function movingTable(images) {
  if (images.length === 0) return null;
  const row = (image) => h('tr', null, h('th', { scope: 'row' }, image.name), h('td', { class: 'number' }, percent(image.masked_ratio)));
  const head = h('tr', null, h('th', { scope: 'col' }, 'Photograph'), h('th', { scope: 'col', class: 'number' }, 'Left out'));
  return [
    h('h3', null, 'Where something moved'),
    h('p', { class: 'muted' }, 'Left out of dense cloud, surface and texture; the masks are in the model, white where something moved.'),
    h('div', { class: 'table-frame', tabindex: 0, role: 'region', 'aria-label': 'Photographs in which something moved' }, h('table', { class: 'narrow', id: 'moving' }, h('thead', null, head), h('tbody', null, images.map(row)))),
  ];
}

function surfaceCards(surface, measure) {
  if (!surface) return [];
  const filled = surface.holes_filled > 0 ? `${plural(surface.holes_filled, 'small one')} filled` : 'none filled';
  return [
    card(count(surface.faces), 'Faces', `${count(surface.vertices)} vertices in ${plural(surface.components, 'piece')}`),
    card(measure.area(surface.area), 'Surface', surface.seen_ratio === null ? 'area of all faces' : `${percent(surface.seen_ratio)} seen by two views or more`),
    card(count(surface.holes_open), surface.holes_open === 1 ? 'Open border' : 'Open borders', filled),
  ];
}

function textureCards(texture) {
  if (!texture) return [];
  const cards = [card(percent(texture.textured_ratio), 'Textured', `from ${plural(texture.views_used, 'view')}, ${plural(texture.pages, 'page')} of ${count(texture.page_size_px)} px, ${plural(texture.charts, 'chart')}`)];
  if (texture.psnr_db !== null) {
    const similarity = texture.ssim === null ? '' : `, SSIM ${fixed(texture.ssim, 3)}`;
    cards.push(card(`${fixed(texture.psnr_db, 1)} dB`, 'PSNR of held-out views', `${plural(texture.held_out_views, 'view')}${similarity}`));
  }
  return cards;
}

function holesTable(holes, measure) {
  if (holes.length === 0) return null;
  const numbers = (center) => center.map((value) => short(value)).join(', ');
  const row = (hole, i) => h('tr', null, h('th', { scope: 'row' }, count(i + 1)), h('td', { class: 'number' }, measure.length(hole.perimeter)), h('td', { class: 'number' }, numbers(hole.center)));
  const head = h('tr', null, h('th', { scope: 'col' }, 'Border'), h('th', { scope: 'col', class: 'number' }, 'Perimeter'), h('th', { scope: 'col', class: 'number' }, 'Centre, model units'));
  return [
    h('h3', null, 'Where the surface is open'),
    h('p', { class: 'muted' }, 'The longest borders. No view saw what lies behind them well enough; more photographs of these places close them.'),
    h('div', { class: 'table-frame', tabindex: 0, role: 'region', 'aria-label': 'Open borders' }, h('table', { class: 'narrow', id: 'holes' }, h('thead', null, head), h('tbody', null, holes.map(row)))),
  ];
}

function loweredList(stages) {
  const items = stages.flatMap(([name, stage]) => (stage?.lowered ?? []).map((text) => h('li', null, h('span', { class: 'badge' }, name), h('span', null, text))));
  return items.length === 0 ? null : [h('h3', null, 'Lowered to keep a limit'), h('ul', { class: 'lowered' }, items)];
}

export function buildSurface(report) {
  const { dense, moving, surface, texture } = report;
  if (!dense && !surface && !texture) return null;
  const measure = measures(report);
  return section(
    'surface',
    'Surface',
    h('dl', { class: 'cards cards-inside' }, denseCards(dense), movingCards(moving), surfaceCards(surface, measure), textureCards(texture)),
    loweredList([['depth maps', dense], ['surface', surface], ['texture', texture]]),
    holesTable(surface?.largest_holes ?? [], measure),
    movingTable(moving?.images ?? []),
  );
}

function picture(base64, text) {
  return h('img', { src: `data:image/jpeg;base64,${base64}`, alt: text, loading: 'lazy', decoding: 'async' });
}

function depthRow(report, entry, measure, onSelect) {
  const image = report.images[entry.image];
  const range = entry.near > 0 ? `depth ${measure.length(entry.near)} (light) to ${measure.length(entry.far)} (dark), ` : '';
  return h(
    'figure',
    { class: 'depth' },
    h('figcaption', null, h('button', { class: 'link name', type: 'button', title: 'Show in 3D', onclick: () => onSelect(entry.image) }, image.name), h('span', { class: 'hint' }, `${range}${percent(entry.filled_ratio)} filled`)),
    h('div', { class: 'depth-pictures' }, picture(entry.picture, `Photograph ${image.name}`), picture(entry.depth, `Depth of ${image.name}`), picture(entry.confidence, `Confidence of ${image.name}`)),
  );
}

/** Photograph, depth and confidence of some views. */
export function buildDepthMaps(report, entries, onSelect) {
  if (entries.length === 0) return null;
  const measure = measures(report);
  return section(
    'depth-maps',
    'Depth maps',
    h('p', { class: 'muted' }, 'Photograph, depth (light is near, grey is unknown) and confidence (white is sure) of some views.'),
    h('div', { class: 'depth-grid' }, entries.map((entry) => depthRow(report, entry, measure, onSelect))),
  );
}
