// The glTF-Transform extension: compressed primitives are read as ordinary ones, and written as such.
import { NodeIO } from '@gltf-transform/core';
import assert from 'node:assert/strict';
import test from 'node:test';
import { createReliefDecoder } from 'relief-gltf';
import { ReliefPatchCompression } from 'relief-gltf/gltf-transform';
import { linearColors } from 'relief-gltf/three';

import { alteredGlb, mixedGlb, outputs, paintedGlb, pointsGlb, readGlb, sphereGlb, streamsOf } from './fixtures.mjs';

const decoder = await createReliefDecoder();
const io = new NodeIO().registerExtensions([ReliefPatchCompression]).registerDependencies({ 'relief.decoder': decoder });
const firstPrimitive = document => document.getRoot().listMeshes()[0].listPrimitives()[0];
const arrayOf = (primitive, name) => primitive.getAttribute(name)?.getArray();

for (const [name, file] of [['sphere', sphereGlb()], ['painted', paintedGlb()], ['points', pointsGlb()]]) {
  test(`${name}: read as the decoder decodes it, and written without compression`, async () => {
    const expected = decoder.decode(streamsOf(file)[0]);
    const document = await io.read(file);
    const check = primitive => {
      assert.deepEqual(arrayOf(primitive, 'POSITION'), expected.positions);
      assert.deepEqual(arrayOf(primitive, 'NORMAL'), expected.normals);
      if (expected.colors) assert.deepEqual(arrayOf(primitive, 'COLOR_0'), linearColors(expected.colors));
      assert.deepEqual(primitive.getIndices()?.getArray() ?? null, name === 'points' ? null : expected.indices);
    };
    check(firstPrimitive(document));
    const plain = `${outputs}/transformed-${name}.glb`;
    await io.write(plain, document);
    assert.equal(readGlb(plain).json.extensionsUsed, undefined);
    assert.equal(readGlb(plain).json.extensionsRequired, undefined);
    check(firstPrimitive(await new NodeIO().read(plain)));
  });
}

test('the rest of a scene is kept', async () => {
  const document = await io.read(mixedGlb());
  assert.deepEqual(document.getRoot().listMaterials().map(material => material.getName()), ['bronze', 'paper']);
  assert.deepEqual(document.getRoot().listNodes().map(node => node.getName()), ['left', 'right', 'empty']);
});

test('a file that contradicts itself is refused with a reason, and so is a missing decoder', async () => {
  const refused = (alter, expected) => assert.rejects(io.read(alteredGlb(alter)), expected);
  await refused((json, { attributes }) => { json.accessors[attributes.POSITION].count += 1; }, /POSITION.*counts/);
  await refused((json, primitive) => { primitive.extensions.RELIEF_patch_compression.bufferView = 99; }, /buffer view 99/);
  await refused((json, primitive, bytes, at) => { bytes[at] = 0; }, { code: 'MAGIC' });
  await assert.rejects(new NodeIO().registerExtensions([ReliefPatchCompression]).read(sphereGlb()), /relief\.decoder/);
});
