// The Babylon.js extension: compressed primitives arrive as ordinary geometry, and the rest of the scene is left alone.
import '@babylonjs/loaders/glTF/2.0/index.js';

import { VertexBuffer } from '@babylonjs/core/Buffers/buffer.js';
import { NullEngine } from '@babylonjs/core/Engines/nullEngine.js';
import { LoadAssetContainerAsync } from '@babylonjs/core/Loading/sceneLoader.js';
import { Logger } from '@babylonjs/core/Misc/logger.js';
import { Scene } from '@babylonjs/core/scene.js';
import assert from 'node:assert/strict';
import fs from 'node:fs';
import test from 'node:test';
import { createReliefDecoder } from 'relief-gltf';
import { registerRelief } from 'relief-gltf/babylon';

import { alteredGlb, mixedGlb, outputs, paintedGlb, pointsGlb, run, sphereGlb, streamsOf } from './fixtures.mjs';

Logger.LogLevels = Logger.ErrorLogLevel;
const decoder = await createReliefDecoder();
registerRelief(decoder);

async function load(file) {
  const scene = new Scene(new NullEngine());
  const container = await LoadAssetContainerAsync(new Uint8Array(fs.readFileSync(file)), scene, { pluginExtension: '.glb' });
  return container.meshes.filter(mesh => mesh.getTotalVertices() > 0);
}

const positions = mesh => mesh.getVerticesData(VertexBuffer.PositionKind);

test('a Relief GLB loads with the arrays that the decoder returns', async () => {
  const file = sphereGlb(), expected = decoder.decode(streamsOf(file)[0]);
  const [mesh] = await load(file);
  assert.deepEqual(positions(mesh), expected.positions);
  assert.deepEqual(mesh.getVerticesData(VertexBuffer.NormalKind), expected.normals);
  assert.deepEqual(Uint32Array.from(mesh.getIndices()), expected.indices);
});

test('colours arrive as in the plain file', async () => {
  const file = paintedGlb(), plain = `${outputs}/painted-plain.glb`;
  run('relief', 'decode', file, plain, '--quiet');
  const [[compressed], [native]] = [await load(file), await load(plain)];
  const colors = mesh => Array.from(mesh.getVerticesData(VertexBuffer.ColorKind));
  assert.equal(colors(compressed).length, 4 * compressed.getTotalVertices());
  const expected = colors(native).map(c => (native.getVertexBuffer(VertexBuffer.ColorKind).normalized && c > 1 ? c / 65535 : c));
  colors(compressed).forEach((c, i) => assert.ok(Math.abs(c - expected[i]) < 1e-6, `${i}: ${c} ${expected[i]}`));
});

test('a compressed primitive of points has no indices', async () => {
  const file = pointsGlb(), expected = decoder.decode(streamsOf(file)[0]);
  const [points] = await load(file);
  assert.deepEqual(positions(points), expected.positions);
  assert.ok(points.isUnIndexed);
});

test('materials, names, plain primitives and instances of a mixed scene are kept', async () => {
  const meshes = await load(mixedGlb());
  assert.deepEqual(meshes.map(mesh => mesh.material?.name ?? mesh.sourceMesh.material.name), ['bronze', 'paper', 'bronze', 'paper']);
  const counts = meshes.map(mesh => mesh.getTotalVertices());
  assert.deepEqual(counts.slice(0, 2), counts.slice(2));
  assert.equal(counts[1], 3);
});

test('a file that contradicts itself is refused with a reason', async () => {
  const refused = (alter, expected) => assert.rejects(load(alteredGlb(alter)), expected);
  await refused((json, { attributes }) => { json.accessors[attributes.POSITION].count += 1; }, /POSITION.*counts/);
  await refused((json, { indices }) => { json.accessors[indices].count -= 3; }, /indices.*counts/);
  await refused((json, primitive, bytes, at) => { bytes[at] = 0; }, /not a Relief stream/);
});
