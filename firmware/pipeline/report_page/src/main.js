// Puts the page together. Marks on <body> tell a test what happened: data-ready, data-problems, data-renderer.

import { readData } from './data.js';
import { createTooltip, h, section } from './dom.js';
import { buildFinish } from './finish.js';
import { buildHistogram } from './histogram.js';
import { buildImageTable } from './image_table.js';
import { buildMatchMatrix } from './match_matrix.js';
import { buildScale } from './scale.js';
import { buildCameras, buildCards, buildHeader, buildNotes, buildSettings } from './summary.js';
import { buildDepthMaps, buildSurface } from './surface.js';
import { buildTimeline } from './timeline.js';
import { buildViewer } from './viewer/viewer.js';

let problems = 0;

function countProblem() {
  document.body.dataset.problems = String(++problems);
}

function watchForProblems() {
  document.body.dataset.problems = '0';
  for (const name of ['error', 'unhandledrejection', 'securitypolicyviolation']) {
    window.addEventListener(name, countProblem);
  }
}

function buildPlots(report, tooltip) {
  if (report.totals.points === 0) return null;
  const { reprojection_error_px: error, track_length: tracks, triangulation_angle_deg: angle } = report.histograms;
  const median = report.totals.reprojection_median_px;
  return section(
    'quality',
    'Quality',
    h(
      'div',
      { class: 'plots' },
      buildHistogram({ title: 'Reprojection error', histogram: error, axis: 'pixels', unit: 'px', things: 'observations', marker: { value: median, text: `median ${median?.toFixed(2)}` } }, tooltip),
      buildHistogram({ title: 'Track length', histogram: tracks, axis: 'images that see a point', unit: 'images', integers: true, things: 'points' }, tooltip),
      buildHistogram({ title: 'Triangulation angle', histogram: angle, axis: 'degrees, largest of a point', unit: '\u00b0', things: 'points' }, tooltip),
    ),
  );
}

function redrawWhenLookChanges(redraw) {
  window.addEventListener('resize', redraw);
  window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redraw);
}

function build() {
  const { report, components, modelFile, depthMaps } = readData();
  document.title = `${report.input || 'Reconstruction'} \u2013 report`;
  const tooltip = createTooltip();
  const viewer = buildViewer(report, components, modelFile, tooltip);
  const select = (image) => {
    if (viewer?.select(image)) viewer.element.scrollIntoView({ behavior: 'smooth', block: 'nearest' });
  };
  const matrix = buildMatchMatrix(report, tooltip, select);
  document.getElementById('report').append(
    ...[
      buildHeader(report),
      buildNotes(report.notes),
      buildCards(report),
      buildFinish(report, select),
      viewer?.element,
      buildScale(report),
      buildSurface(report),
      buildDepthMaps(report, depthMaps, select),
      buildPlots(report, tooltip),
      buildTimeline(report, tooltip),
      buildImageTable(report, select),
      matrix?.element,
      buildCameras(report),
      buildSettings(report),
      h('footer', { class: 'muted' }, report.software),
    ].filter(Boolean),
  );
  viewer?.start();
  if (matrix) {
    matrix.redraw();
    redrawWhenLookChanges(matrix.redraw);
  }
}

watchForProblems();
try {
  build();
} catch (error) {
  countProblem();
  document.getElementById('report').prepend(h('p', { class: 'note note-error' }, `The report cannot be drawn: ${error}`));
  throw error;
} finally {
  document.body.dataset.requests = String(performance.getEntriesByType('resource').filter((entry) => !/^(data|blob):/.test(entry.name)).length);
  document.body.dataset.ready = 'true';
}
