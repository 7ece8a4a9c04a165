// The mesh of the page's GLB, put where the cameras and points are.

import { Group, Matrix4, TextureLoader, Vector3 } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

import { boundingSphere } from './model.js';

const BOUND_SAMPLES = 3000;
const ANISOTROPY = 8;

/** Pictures come in as elements: the other way fetches, which the page's policy forbids. */
function withPicturesAsElements(parser) {
  parser.textureLoader = new TextureLoader(parser.options.manager);
  return { name: 'pictures-as-elements' };
}

/** About `most` vertices, evenly picked, in the world. */
function sampleVertices(meshes, most) {
  const total = meshes.reduce((sum, mesh) => sum + mesh.geometry.attributes.position.count, 0);
  const step = Math.max(1, Math.floor(total / most));
  const positions = [];
  const vertex = new Vector3();
  for (const mesh of meshes) {
    const { position } = mesh.geometry.attributes;
    for (let i = 0; i < position.count; i += step) positions.push(...vertex.fromBufferAttribute(position, i).applyMatrix4(mesh.matrixWorld).toArray());
  }
  return new Float32Array(positions);
}

/** { object, faces, pages, positions: a sample, center, radius }, all in the world of the reconstruction. */
export async function loadMesh(glb) {
  const loader = new GLTFLoader().register(withPicturesAsElements);
  const gltf = await loader.parseAsync(glb, '');
  const object = new Group();
  const placement = gltf.asset.extras?.model_from_world;
  if (placement) new Matrix4().fromArray(placement).invert().decompose(object.position, object.quaternion, object.scale);
  object.add(gltf.scene);
  object.updateMatrixWorld(true);
  const meshes = [];
  object.traverse((child) => child.isMesh && meshes.push(child));
  const maps = new Set(meshes.map((mesh) => mesh.material.map).filter(Boolean));
  for (const map of maps) map.anisotropy = ANISOTROPY;
  const positions = sampleVertices(meshes, BOUND_SAMPLES);
  return {
    object,
    faces: meshes.reduce((sum, mesh) => sum + mesh.geometry.index.count / 3, 0),
    pages: maps.size,
    positions,
    ...boundingSphere(positions, []),
  };
}
