// What the 3D view knows about one component: bounds, up direction, camera frusta, links. World coordinates throughout.

import { Matrix3, Quaternion, Vector3 } from 'three';

const BOUND_QUANTILE = 0.03;
const FRUSTUM_LIMIT = 1.5; // widest half extent at unit depth; a fisheye has no flat image plane
const DEFAULT_EXTENT = { left: -0.6, right: 0.6, top: -0.4, bottom: 0.4 };

function quantiles(values) {
  values.sort();
  const at = (quantile) => values[Math.round(quantile * (values.length - 1))];
  return [at(BOUND_QUANTILE), at(1 - BOUND_QUANTILE)];
}

/** Sphere around the bulk of the points and all cameras; stray far points do not count. */
export function boundingSphere(positions, poses) {
  const low = new Vector3(Infinity, Infinity, Infinity);
  const high = new Vector3(-Infinity, -Infinity, -Infinity);
  if (positions.length > 0) {
    const axes = [0, 1, 2].map((axis) => quantiles(positions.filter((_, i) => i % 3 === axis)));
    low.set(...axes.map((range) => range[0]));
    high.set(...axes.map((range) => range[1]));
  }
  for (const pose of poses) {
    low.min(pose.center);
    high.max(pose.center);
  }
  const center = low.clone().add(high).multiplyScalar(0.5);
  return { center, radius: Math.max(1e-9, 0.5 * high.distanceTo(low)) };
}

function medianNeighbourDistance(poses) {
  const nearest = poses.map((pose) => Math.min(...poses.filter((other) => other !== pose).map((other) => pose.center.distanceTo(other.center))));
  nearest.sort((a, b) => a - b);
  return nearest[nearest.length >> 1];
}

/** A length for drawing cameras: readable, but neighbours do not hide each other. */
function cameraUnit(poses, radius) {
  const apart = poses.length > 1 ? medianNeighbourDistance(poses) : radius;
  return Math.min(0.09 * radius, Math.max(0.02 * radius, 0.45 * apart));
}

/**
 * The direction that photographers hold up: across all image rows (cameras are rarely rolled), on the side where the
 * tops of the images point. Smallest eigenvector of sum(x x') with a weak pull to the mean image top.
 */
function estimateUp(poses) {
  const top = new Vector3();
  for (const pose of poses) top.sub(new Vector3(0, 1, 0).applyQuaternion(pose.rotation));
  if (top.length() < 1e-3 * Math.max(1, poses.length)) return new Vector3(0, -1, 0);
  top.normalize();
  const pull = 0.02 * poses.length;
  const sum = [0, 0, 0, 0, 0, 0, 0, 0, 0];
  const addOuter = (v, weight) => {
    const c = v.toArray();
    for (let i = 0; i < 9; ++i) sum[i] += weight * c[Math.floor(i / 3)] * c[i % 3];
  };
  for (const pose of poses) addOuter(new Vector3(1, 0, 0).applyQuaternion(pose.rotation), 1);
  addOuter(top, -pull);
  const trace = poses.length + pull;
  const shifted = new Matrix3().set(...sum.map((value, i) => (i % 4 === 0 ? trace : 0) - value));
  const up = top.clone();
  for (let i = 0; i < 200; ++i) up.applyMatrix3(shifted).normalize();
  return up.dot(top) < 0 ? up.negate() : up;
}

/** Where the image borders lie at unit depth. */
function imageExtent(camera) {
  if (!camera) return DEFAULT_EXTENT;
  const limit = (value) => Math.max(-FRUSTUM_LIMIT, Math.min(FRUSTUM_LIMIT, value));
  return {
    left: limit((-0.5 - camera.cx_px) / camera.fx_px),
    right: limit((camera.width_px - 0.5 - camera.cx_px) / camera.fx_px),
    top: limit((-0.5 - camera.cy_px) / camera.fy_px),
    bottom: limit((camera.height_px - 0.5 - camera.cy_px) / camera.fy_px),
  };
}

function buildPoses(component, report) {
  return component.poses.map((pose) => ({
    image: pose.image,
    center: new Vector3(...pose.center),
    rotation: new Quaternion(...pose.rotation),
    extent: imageExtent(report.cameras[pose.camera]),
    seen: pose.seen,
    links: [],
  }));
}

/** Pairs that constrain the model, between poses of this component. */
function buildLinks(poses, report) {
  const poseOfImage = new Map(poses.map((pose, i) => [pose.image, i]));
  const links = [];
  for (const pair of report.pairs) {
    const first = poseOfImage.get(pair.first);
    const second = poseOfImage.get(pair.second);
    if (first === undefined || second === undefined || pair.inliers === 0) continue;
    links.push({ first, second, inliers: pair.inliers });
    poses[first].links.push({ pose: second, inliers: pair.inliers });
    poses[second].links.push({ pose: first, inliers: pair.inliers });
  }
  for (const pose of poses) pose.links.sort((a, b) => b.inliers - a.inliers);
  return links;
}

export function buildModel(component, report) {
  const poses = buildPoses(component, report);
  const { center, radius } = boundingSphere(component.positions, poses);
  const links = buildLinks(poses, report);
  return {
    positions: component.positions,
    colors: component.colors,
    pointsTotal: component.pointsTotal,
    poses,
    links,
    mostInliers: links.reduce((most, link) => Math.max(most, link.inliers), 1),
    center,
    radius,
    unit: cameraUnit(poses, radius),
    up: estimateUp(poses),
  };
}

/** About `most` of the points, evenly picked. */
export function samplePoints(model, most) {
  const total = model.positions.length / 3;
  const step = Math.max(1, Math.floor(total / most));
  const sample = [];
  for (let point = 0; point < total; point += step) sample.push(new Vector3().fromArray(model.positions, 3 * point));
  return sample;
}

/** The four corners of the image plane (top left, top right, bottom right, bottom left), in the world. */
export function frustumCorners(pose, depth) {
  const { left, right, top, bottom } = pose.extent;
  return [
    [left, top],
    [right, top],
    [right, bottom],
    [left, bottom],
  ].map(([x, y]) => new Vector3(x, y, 1).multiplyScalar(depth).applyQuaternion(pose.rotation).add(pose.center));
}

/** Collects line segments: positions 3 and colours 4 numbers a vertex. */
function createLines() {
  const positions = [];
  const colors = [];
  return {
    add(a, b, color) {
      positions.push(a.x, a.y, a.z, b.x, b.y, b.z);
      colors.push(...color, ...color);
    },
    finish: () => ({ positions: new Float32Array(positions), colors: new Float32Array(colors) }),
  };
}

function poseColor(model, state, palette, index) {
  if (state.selected < 0) return [...palette.camera, 0.9];
  if (index === state.selected) return [...palette.selected, 1];
  const linked = model.poses[state.selected].links.some((link) => link.pose === index);
  return [...palette.camera, linked ? 0.9 : 0.25];
}

function addFrustum(lines, pose, depth, color) {
  const corners = frustumCorners(pose, depth);
  for (let i = 0; i < 4; ++i) {
    lines.add(pose.center, corners[i], color);
    lines.add(corners[i], corners[(i + 1) % 4], color);
  }
  // A roof over the upper border tells which side of the image is up.
  const roof = corners[0].clone().add(corners[1]).multiplyScalar(0.5);
  roof.addScaledVector(corners[0].clone().sub(corners[3]), 0.18);
  lines.add(corners[0], roof, color);
  lines.add(roof, corners[1], color);
}

/** All lines to draw for this state. palette: { camera, selected, link } as [r, g, b] in 0..1. */
export function buildLines(model, state, palette) {
  const lines = createLines();
  for (const link of model.links) {
    const ofSelected = link.first === state.selected || link.second === state.selected;
    if (!ofSelected && !(state.showLinks && state.selected < 0)) continue;
    const strength = Math.log1p(link.inliers) / Math.log1p(model.mostInliers);
    const color = ofSelected ? [...palette.selected, 0.25 + 0.75 * strength] : [...palette.link, 0.08 + 0.5 * strength ** 3];
    lines.add(model.poses[link.first].center, model.poses[link.second].center, color);
  }
  if (state.showCameras) {
    model.poses.forEach((pose, index) => addFrustum(lines, pose, model.unit * state.cameraSize, poseColor(model, state, palette, index)));
  }
  return lines.finish();
}

/** Per point 1 when the selected camera sees it. */
export function seenMask(model, state) {
  const mask = new Uint8Array(model.positions.length / 3);
  if (state.selected >= 0) {
    for (const point of model.poses[state.selected].seen) mask[point] = 1;
  }
  return mask;
}
