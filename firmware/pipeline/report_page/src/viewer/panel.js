// The controls over the 3D view and the card of the selected camera.

import { h } from '../dom.js';
import { baseName, count, fixed, plural } from '../format.js';

const MOST_LINKS = 6;

export const UP_CHOICES = [
  ['cameras', 'as the cameras were held'],
  ['0,-1,0', '\u2212Y'],
  ['0,1,0', '+Y'],
  ['0,0,1', '+Z'],
  ['0,0,-1', '\u2212Z'],
  ['1,0,0', '+X'],
  ['-1,0,0', '\u2212X'],
];

function toggle(label, key, state, changed) {
  const button = h('button', { type: 'button', class: 'toggle', 'aria-pressed': String(state[key]) }, label);
  button.addEventListener('click', () => {
    state[key] = !state[key];
    button.setAttribute('aria-pressed', String(state[key]));
    changed();
  });
  return button;
}

function slider(label, key, range, state, changed) {
  const input = h('input', { type: 'range', min: range.min, max: range.max, step: range.step, value: state[key] });
  input.addEventListener('input', () => {
    state[key] = Number(input.value);
    changed();
  });
  return h('label', { class: 'control' }, h('span', null, label), input);
}

function choice(label, options, changed) {
  const select = h('select', null, options.map(([value, text]) => h('option', { value }, text)));
  select.addEventListener('change', () => changed(select.value));
  return h('label', { class: 'control' }, h('span', null, label), select);
}

/** actions: { changed(), setUp(text), setComponent(index), reset() }; `hasMesh`: whether there is a mesh to switch. */
export function buildToolbar(state, models, hasMesh, actions) {
  const switches = [['Points', 'showPoints'], ['Cameras', 'showCameras'], ['Links', 'showLinks']];
  if (hasMesh) switches.unshift(['Mesh', 'showMesh']);
  const toggles = switches.map(([label, key]) => [key, toggle(label, key, state, actions.changed)]);
  const components = models.map((model, i) => [String(i), `${i === 0 ? 'main' : i + 1}: ${plural(model.poses.length, 'image')}`]);
  const element = h(
    'div',
    { class: 'toolbar', role: 'toolbar', 'aria-label': '3D view' },
    toggles.map(([, button]) => button),
    slider('Point size', 'pointSize', { min: 1, max: 8, step: 0.5 }, state, actions.changed),
    slider('Camera size', 'cameraSize', { min: 0.2, max: 4, step: 0.1 }, state, actions.changed),
    choice('Up', UP_CHOICES, actions.setUp),
    models.length > 1 ? choice('Model', components, (value) => actions.setComponent(Number(value))) : null,
    h('button', { type: 'button', class: 'toggle', onclick: actions.reset }, 'Reset view'),
  );
  const componentSelect = models.length > 1 ? element.querySelectorAll('select')[1] : null;
  return {
    element,
    /** Once the state has changed in another way than by the buttons. */
    showState() {
      for (const [key, button] of toggles) button.setAttribute('aria-pressed', String(state[key]));
    },
    showComponent(index) {
      if (componentSelect) componentSelect.value = String(index);
    },
  };
}

function fact(label, value) {
  return h('div', null, h('dt', null, label), h('dd', null, value));
}

/** actions: { select(pose), lookThrough(), close() }. */
export function buildCameraCard(model, index, report, actions) {
  const pose = model.poses[index];
  const image = report.images[pose.image];
  const links = pose.links.slice(0, MOST_LINKS).map((link) =>
    h(
      'li',
      null,
      h('button', { type: 'button', class: 'link', onclick: () => actions.select(link.pose) }, baseName(report.images[model.poses[link.pose].image].name)),
      h('span', { class: 'muted' }, ` ${count(link.inliers)}`),
    ),
  );
  return [
    h('h3', null, image.name),
    h(
      'dl',
      null,
      fact('Observations', count(image.observations)),
      fact('Error RMS', `${fixed(image.reprojection_rmse_px, 2)} px`),
      fact('Features', count(image.features)),
      fact('Overlaps with', plural(pose.links.length, 'image')),
    ),
    links.length > 0 ? [h('p', { class: 'hint' }, 'Strongest links, agreeing matches'), h('ol', null, links)] : null,
    h(
      'div',
      { class: 'card-buttons' },
      h('button', { type: 'button', class: 'toggle', onclick: actions.lookThrough }, 'Look through'),
      h('button', { type: 'button', class: 'toggle', onclick: actions.close }, 'Deselect'),
    ),
  ];
}
