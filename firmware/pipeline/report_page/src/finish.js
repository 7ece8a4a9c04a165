// The verdict at the end: ready, or what is missing and from where to shoot it.

import { h, section } from './dom.js';

function gapItem(report, gap, onSelect) {
  const image = report.images.findIndex((candidate) => candidate.name === gap.photograph);
  const show = image < 0 ? null : h('button', { class: 'link', type: 'button', title: 'Show in 3D', onclick: () => onSelect(image) }, 'show the photograph');
  return h('li', null, gap.advice, ' ', show);
}

export function buildFinish(report, onSelect) {
  const { finish } = report;
  if (!finish) return null;
  return section(
    'finish',
    'Ready or not',
    h('p', { id: 'finish-verdict', class: finish.ready ? 'finish-ready' : 'finish-not-ready' }, finish.sentence),
    finish.gaps.length === 0 ? null : h('ol', { class: 'gaps' }, finish.gaps.map((gap) => gapItem(report, gap, onSelect))),
  );
}
