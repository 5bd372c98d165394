// The three.js plugin: compressed primitives arrive as ordinary geometry, and the rest of the scene is left alone.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import test from 'node:test';
import { createReliefDecoder } from 'relief-gltf';
import { linearColors, ReliefPatchCompression } from 'relief-gltf/three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

import { alteredGlb, mixedGlb, outputs, paintedGlb, pointsGlb, run, sphereGlb, streamsOf, writeGlb } from './fixtures.mjs';

async function load(file, decoder) {
  const loader = new GLTFLoader();
  let plugin;
  loader.register(parser => (plugin = new ReliefPatchCompression(parser, decoder)));
  const bytes = new Uint8Array(fs.readFileSync(file));
  const gltf = await loader.parseAsync(bytes.buffer, '');
  const meshes = [];
  gltf.scene.traverse(object => object.isMesh && meshes.push(object));
  return { gltf, meshes, stats: plugin.stats };
}

test('a Relief GLB loads with the arrays that the decoder returns', async () => {
  const decoder = await createReliefDecoder();
  const file = sphereGlb();
  const [stream] = streamsOf(file);
  const expected = decoder.decode(stream);
  const { meshes, stats } = await load(file, decoder);
  assert.equal(meshes.length, 1);
  const { attributes, index, boundingBox } = meshes[0].geometry;
  assert.deepEqual(attributes.position.array, expected.positions);
  assert.deepEqual(index.array, expected.indices);
  if (attributes.normal) assert.deepEqual(attributes.normal.array, expected.normals);
  assert.deepEqual([stats.streams, stats.bytes], [1, stream.length]);
  assert.deepEqual([stats.vertices, stats.triangles], [expected.vertexCount, expected.triangleCount]);
  for (let axis = 0; axis < 3; axis++) {  // min and max of the accessor are those of the decoded surface
    const values = expected.positions.filter((_, i) => i % 3 === axis);
    assert.ok(Math.abs(values.reduce((a, b) => Math.min(a, b)) - boundingBox.min.getComponent(axis)) < 1e-6);
    assert.ok(Math.abs(values.reduce((a, b) => Math.max(a, b)) - boundingBox.max.getComponent(axis)) < 1e-6);
  }
});

test('a compressed primitive of points loads as points', async () => {
  const decoder = await createReliefDecoder();
  const file = pointsGlb();
  const expected = decoder.decode(streamsOf(file)[0]);
  const { gltf } = await load(file, decoder);
  const points = [];
  gltf.scene.traverse(object => object.isPoints && points.push(object));
  assert.equal(points.length, 1);
  assert.equal(points[0].geometry.index, null);
  assert.deepEqual(points[0].geometry.attributes.position.array, expected.positions);
});

test('colours arrive linear, in 16 bits', async () => {
  const decoder = await createReliefDecoder();
  const file = paintedGlb();
  const expected = decoder.decode(streamsOf(file)[0]);
  assert.equal(expected.colors.length, 4 * expected.vertexCount);
  const { meshes } = await load(file, decoder);
  const { color } = meshes[0].geometry.attributes;
  assert.ok(color.normalized && color.array instanceof Uint16Array);
  assert.deepEqual(color.array, linearColors(expected.colors));
  assert.ok(meshes[0].material.vertexColors);
  const plain = `${outputs}/painted-plain.glb`;
  run('relief', 'decode', file, plain, '--quiet');
  const native = await load(plain, null);
  assert.deepEqual(native.meshes[0].geometry.attributes.color.array, color.array);
  assert.equal(decoder.decode(streamsOf(file)[0], { colors: false }).colors, null);
});

test('materials, names, plain primitives and instances of a mixed scene are kept', async () => {
  const decoder = await createReliefDecoder();
  const file = mixedGlb();
  const { gltf, meshes, stats } = await load(file, decoder);
  const children = Object.fromEntries(gltf.scene.children.map(child => [child.name, child]));
  assert.deepEqual(Object.keys(children), ['left', 'right', 'empty']);
  assert.equal(children.left.position.x, -2);
  assert.equal(children.empty.userData.kept, 7);
  assert.equal(meshes.length, 4);
  assert.deepEqual(meshes.map(mesh => mesh.material.name), ['bronze', 'paper', 'bronze', 'paper']);
  assert.deepEqual(meshes.map(mesh => mesh.geometry.attributes.position.count), [stats.vertices, 3, stats.vertices, 3]);
  assert.equal(meshes[0].geometry, meshes[2].geometry, 'instances share one geometry');
  assert.equal(stats.streams, 1, 'a stream used twice is decoded once');
});

test('natively decoded, the mixed scene has the same vertices', async () => {
  const plain = `${outputs}/mixed-plain.glb`;
  run('relief', 'decode', mixedGlb(), plain, '--quiet');
  const [a, b] = [await load(mixedGlb(), await createReliefDecoder()), await load(plain, null)];
  assert.deepEqual(b.meshes.map(m => m.geometry.attributes.position.array), a.meshes.map(m => m.geometry.attributes.position.array));
  assert.deepEqual(b.meshes.map(m => m.geometry.index?.array), a.meshes.map(m => m.geometry.index?.array));
  assert.deepEqual(b.meshes.map(m => m.name), a.meshes.map(m => m.name));
});

test('a file without the extension loads as before', async () => {
  const binary = Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer);
  const file = `${outputs}/plain.glb`;
  writeGlb(file, {
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
    accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] }],
    bufferViews: [{ buffer: 0, byteLength: 36 }], buffers: [{ byteLength: 36 }],
  }, binary);
  const { meshes, stats } = await load(file, await createReliefDecoder());
  assert.equal(meshes[0].geometry.attributes.position.count, 3);
  assert.equal(stats.streams, 0);
});

const assertRefused = async (alter, expected) => assert.rejects(load(alteredGlb(alter), await createReliefDecoder()), expected);

test('a file that contradicts itself is refused with a reason', async () => {
  await assertRefused((json, primitive) => { json.accessors[primitive.attributes.POSITION].count += 1; }, /POSITION.*counts/);
  await assertRefused((json, primitive) => { json.accessors[primitive.indices].count -= 3; }, /indices.*counts/);
  await assertRefused((json, primitive) => { json.accessors[primitive.indices].type = 'VEC3'; }, /SCALAR/);
  await assertRefused((json, primitive) => { delete primitive.indices; }, /needs indices/);
  await assertRefused((json, primitive, bytes, at) => { bytes[at] = 0; }, { code: 'MAGIC' });
});
