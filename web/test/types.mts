// Compiled by package.test.mjs, never run: the public interface as an application uses it.
import { createReliefDecoder, ReliefError, type ReliefIncremental, type ReliefInfo, type ReliefMesh } from 'relief-gltf';
import { registerRelief } from 'relief-gltf/babylon';
import { ReliefPatchCompression as ReliefReader } from 'relief-gltf/gltf-transform';
import { linearColors, ReliefPatchCompression } from 'relief-gltf/three';
import { NodeIO } from '@gltf-transform/core';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

const decoder = await createReliefDecoder({ workers: 2 });
const own = await createReliefDecoder({ module: new Uint8Array(8) });
const info: ReliefInfo = decoder.inspect(new Uint8Array(8), { limits: { maxPatches: 4, maxMemory: 2 ** 30 }, level: 1 });
const mesh: ReliefMesh = decoder.decode(new ArrayBuffer(8), { normals: false, limits: { maxVertices: 100 } });
const normals: Float32Array | null = mesh.normals;
const coarse: ReliefMesh = await decoder.decodeAsync(new Uint8Array(8), { level: 2, points: true, patches: [true, false] });
const [x, y, z]: [number, number, number] = coarse.min;
console.log(x, y, z);
const incremental: ReliefIncremental = decoder.incremental({ level: 1 });
const sofar: ReliefMesh | null = incremental.push(new Uint8Array(8)) ?? incremental.push(new ArrayBuffer(8), { mesh: false });
console.log(sofar?.vertexCount);
own.dispose();
const colors: Uint16Array | null = mesh.colors && linearColors(mesh.colors);
console.log(colors?.length, info.hasColors);
registerRelief(decoder);
new NodeIO().registerExtensions([ReliefReader]).registerDependencies({ 'relief.decoder': decoder });
new GLTFLoader().register(parser => new ReliefPatchCompression(parser, decoder));
try {
  decoder.decode(new Uint8Array(info.masksEnd));
} catch (error) {
  if (error instanceof ReliefError && error.code === 'TRUNCATED') console.log(normals, error.message);
}
// @ts-expect-error a stream is bytes
decoder.decode('RLF');
// @ts-expect-error a level is a number
decoder.decode(new Uint8Array(8), { level: '2' });
