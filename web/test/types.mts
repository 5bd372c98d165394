// Compiled by package.test.mjs, never run: the public interface as an application uses it.
import { createReliefDecoder, ReliefError, type ReliefInfo, type ReliefMesh } from 'relief-gltf';
import { ReliefPatchCompression } from 'relief-gltf/three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

const decoder = await createReliefDecoder(new URL('https://example.org/relief.wasm'));
const info: ReliefInfo = decoder.inspect(new Uint8Array(8), { maxPatches: 4 });
const mesh: ReliefMesh = decoder.decode(new ArrayBuffer(8), { normals: false, limits: { maxVertices: 100 } });
const normals: Float32Array | null = mesh.normals;
new GLTFLoader().register(parser => new ReliefPatchCompression(parser, decoder));
try {
  decoder.decode(new Uint8Array(info.masksEnd));
} catch (error) {
  if (error instanceof ReliefError && error.code === 'TRUNCATED') console.log(normals, error.message);
}
// @ts-expect-error a stream is bytes
decoder.decode('RLF');
