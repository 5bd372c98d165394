// Meshes in and out of files, for the peers.
import fs from 'node:fs';
import { createRequire } from 'node:module';
import path from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

export const root = fileURLToPath(new URL('..', import.meta.url));

// three.js is installed for web/.
const three = createRequire(path.join(root, 'web/package.json')).resolve('three').replace(/build[\\/].*/, '');
const addon = name => import(pathToFileURL(path.join(three, 'examples/jsm', name)).href);
const { PLYLoader } = await addon('loaders/PLYLoader.js');
const { GLTFLoader } = await addon('loaders/GLTFLoader.js');
const { Vector3 } = await import(pathToFileURL(path.join(three, 'build/three.module.js')).href);

// { positions: Float32Array, indices: Uint32Array }
export function readPly(file) {
  const bytes = fs.readFileSync(file);
  const geometry = new PLYLoader().parse(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
  if (!geometry.index) throw new Error(`${file}: no faces`);
  return { positions: new Float32Array(geometry.attributes.position.array), indices: new Uint32Array(geometry.index.array) };
}

export function writePly(file, { positions, indices }) {
  const faces = Buffer.alloc(indices.length / 3 * 13);
  for (let i = 0, at = 0; i < indices.length; i += 3) {
    at = faces.writeUInt8(3, at);
    for (let k = 0; k < 3; k++) at = faces.writeUInt32LE(indices[i + k], at);
  }
  const header = 'ply\nformat binary_little_endian 1.0\n' +
    `element vertex ${positions.length / 3}\nproperty float x\nproperty float y\nproperty float z\n` +
    `element face ${indices.length / 3}\nproperty list uchar int vertex_indices\nend_header\n`;
  fs.writeFileSync(file, Buffer.concat([Buffer.from(header), Buffer.from(positions.buffer, positions.byteOffset, positions.byteLength), faces]));
}

// A plain OBJ, which gltfpack reads.
export function writeObj(file, { positions, indices }) {
  const out = fs.openSync(file, 'w');
  const flush = lines => fs.writeSync(out, lines.join(''));
  for (let i = 0; i < positions.length; i += 30000) {
    const lines = [];
    for (let k = i; k < Math.min(i + 30000, positions.length); k += 3) lines.push(`v ${positions[k]} ${positions[k + 1]} ${positions[k + 2]}\n`);
    flush(lines);
  }
  for (let i = 0; i < indices.length; i += 30000) {
    const lines = [];
    for (let k = i; k < Math.min(i + 30000, indices.length); k += 3) lines.push(`f ${indices[k] + 1} ${indices[k + 1] + 1} ${indices[k + 2] + 1}\n`);
    flush(lines);
  }
  fs.closeSync(out);
}

// All meshes of a GLB in world space, as one. `meshopt` is meshoptimizer's decoder.
export async function readGlb(file, meshopt) {
  const bytes = fs.readFileSync(file);
  const loader = new GLTFLoader().setMeshoptDecoder(meshopt);
  const { scene } = await loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), '');
  const positions = [], indices = [];
  scene.updateMatrixWorld(true);
  scene.traverse(({ isMesh, geometry, matrixWorld }) => {
    if (!isMesh) return;
    const base = positions.length / 3;
    const { position } = geometry.attributes;
    const point = new Vector3();
    for (let i = 0; i < position.count; i++) {
      point.fromBufferAttribute(position, i).applyMatrix4(matrixWorld);
      positions.push(point.x, point.y, point.z);
    }
    for (const index of geometry.index.array) indices.push(base + index);
  });
  return { positions: Float32Array.from(positions), indices: Uint32Array.from(indices) };
}

// Vertices at the same place become one, as when only the surface counts: not its texture coordinates.
export function weld({ positions, indices }) {
  const first = new Map();
  const place = new Uint32Array(positions.length / 3).map((_, vertex) => {
    const key = positions.subarray(3 * vertex, 3 * vertex + 3).join();
    if (!first.has(key)) first.set(key, vertex);
    return first.get(key);
  });
  const triangles = [];
  for (let i = 0; i < indices.length; i += 3) {
    const [a, b, c] = [place[indices[i]], place[indices[i + 1]], place[indices[i + 2]]];
    if (a !== b && b !== c && c !== a) triangles.push(a, b, c);
  }
  return compact({ positions, indices: Uint32Array.from(triangles) });
}

// Leaves out vertices that no triangle uses.
export function compact({ positions, indices }) {
  const place = new Int32Array(positions.length / 3).fill(-1);
  const kept = [];
  const renumbered = indices.map(vertex => {
    if (place[vertex] < 0) {
      place[vertex] = kept.length / 3;
      kept.push(...positions.subarray(3 * vertex, 3 * vertex + 3));
    }
    return place[vertex];
  });
  return { positions: Float32Array.from(kept), indices: renumbered };
}
