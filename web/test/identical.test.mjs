// Native and WebAssembly decoders give the same bits, with vectors and without.
import assert from 'node:assert/strict';
import crypto from 'node:crypto';
import fs from 'node:fs';
import test from 'node:test';
import { createReliefDecoder } from 'relief-gltf';

import { largeModels, modelGlb, paintedGlb, run, scratch, sphereFile, streamsOf } from './fixtures.mjs';

const sha256 = (...parts) => {
  const hash = crypto.createHash('sha256');
  for (const part of parts) hash.update(new Uint8Array(part.buffer, part.byteOffset, part.byteLength));
  return hash.digest('hex');
};

function nativeHash(stream, name) {
  const input = scratch(`${name}.relief`), output = scratch(`${name}.raw`);
  fs.writeFileSync(input, stream);
  run('decode_raw', input, output);
  return sha256(fs.readFileSync(output));
}

const decoders = Promise.all(['relief.wasm', 'relief-simd.wasm'].map(async module =>
  [module, await createReliefDecoder({ module: fs.readFileSync(new URL(`../../wasm/dist/${module}`, import.meta.url)) })]));

test('colours: same SHA-256 natively and in WebAssembly', async () => {
  const [stream] = streamsOf(paintedGlb());
  for (const [module, decoder] of await decoders) {
    for (const [name, bytes] of [['painted', stream], ['painted-prefix', stream.slice(0, stream.length - 100)]]) {
      const mesh = decoder.decode(bytes);
      assert.equal(sha256(mesh.positions, mesh.normals, mesh.indices, mesh.colors), nativeHash(bytes, name), module);
    }
  }
});

for (const [name, file] of [['sphere', sphereFile()], ...largeModels()]) {
  test(`${name}: same SHA-256 natively and in WebAssembly`, { skip: file ? false : `no ${name} on this machine` }, async t => {
    const [stream] = streamsOf(modelGlb(name, file));
    for (const [module, decoder] of await decoders) {
      const mesh = decoder.decode(stream);
      const hash = sha256(mesh.positions, mesh.normals, mesh.indices);
      assert.equal(hash, nativeHash(stream, name), module);
      t.diagnostic(`${module}: ${stream.length} bytes, ${mesh.vertexCount} vertices, ${mesh.triangleCount} triangles, ${hash}`);

      const { masksEnd } = decoder.inspect(stream);
      const prefix = stream.slice(0, Math.floor((masksEnd + stream.length) / 2));
      const coarse = decoder.decode(prefix);
      assert.equal(sha256(coarse.positions, coarse.normals, coarse.indices), nativeHash(prefix, `${name}-prefix`), module);
    }
  });
}
