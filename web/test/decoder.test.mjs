// The WebAssembly decoder through its loader: size, errors, recovery.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import { syncBuiltinESMExports } from 'node:module';
import path from 'node:path';
import test from 'node:test';
import { createReliefDecoder, ReliefError } from 'relief-gltf';

import { sphereGlb, streamsOf } from './fixtures.mjs';

const wasm = fs.readFileSync(new URL('../dist/relief.wasm', import.meta.url));
const simd = fs.readFileSync(new URL('../dist/relief-simd.wasm', import.meta.url));
const stream = streamsOf(sphereGlb())[0];

// Runs `call` and returns the code of the ReliefError it throws, or 'OK'.
function codeOf(call) {
  try {
    call();
    return 'OK';
  } catch (error) {
    assert.ok(error instanceof ReliefError, `not a ReliefError: ${error.stack}`);
    assert.ok(error.message.length > 5);
    return error.code;
  }
}

function assertWellFormed(mesh) {
  assert.equal(mesh.positions.length, 3 * mesh.vertexCount);
  assert.equal(mesh.indices.length, 3 * mesh.triangleCount);
  assert.ok(mesh.indices.every(index => index < mesh.vertexCount), 'an index is out of range');
  assert.ok(mesh.positions.every(Number.isFinite), 'a position is not finite');
}

test('the modules import nothing and keep to 40 KB, with vectors to 46.5', () => {
  for (const [bytes, most] of [[wasm, 40_000], [simd, 46_500]]) {
    assert.deepEqual(WebAssembly.Module.imports(new WebAssembly.Module(bytes)), []);
    assert.ok(bytes.length <= most, `${bytes.length} bytes`);
  }
});

test('the module with vectors is taken where there are vectors, else the other one', async () => {
  const { validate } = WebAssembly, { readFile } = fs.promises, taken = [];
  fs.promises.readFile = url => (taken.push(path.basename(url.pathname)), readFile(url));
  syncBuiltinESMExports();
  try {
    await createReliefDecoder();
    WebAssembly.validate = () => false;
    await createReliefDecoder();
  } finally {
    WebAssembly.validate = validate;
    fs.promises.readFile = readFile;
    syncBuiltinESMExports();
  }
  assert.deepEqual(taken, ['relief-simd.wasm', 'relief.wasm']);
});

test('both modules give the same mesh, whole and from prefixes', async () => {
  const [plain, vectors] = await Promise.all([createReliefDecoder(wasm), createReliefDecoder(simd)]);
  const { masksEnd } = plain.inspect(stream);
  for (const size of [masksEnd, (masksEnd + stream.length) >> 1, stream.length]) {
    assert.deepEqual(vectors.decode(stream.slice(0, size)), plain.decode(stream.slice(0, size)));
  }
});

test('the decoder can be made from bytes, from a module, from an address, and by default', async () => {
  const module = await WebAssembly.compile(wasm);
  const address = new URL('../dist/relief.wasm', import.meta.url);
  for (const source of [wasm, simd, new Uint8Array(wasm).buffer, module, address, address.href, undefined]) {
    const decoder = await createReliefDecoder(source);
    assert.equal(decoder.inspect(stream).version, 0);
  }
  await assert.rejects(createReliefDecoder(new URL('./missing.wasm', address)), /missing\.wasm/);
});

test('a whole stream decodes to the counts it announces', async () => {
  const decoder = await createReliefDecoder();
  const info = decoder.inspect(stream);
  const mesh = decoder.decode(stream);
  assert.equal(mesh.vertexCount, info.vertexCount);
  assert.equal(mesh.triangleCount, info.triangleCount);
  assert.ok(mesh.vertexCount > 100);
  assertWellFormed(mesh);
  for (let i = 0; i < mesh.normals.length; i += 3) {
    assert.ok(Math.abs(Math.hypot(...mesh.normals.subarray(i, i + 3)) - 1) < 1e-3, `normal ${i / 3} is not of unit length`);
  }
  const bare = decoder.decode(stream.buffer.slice(stream.byteOffset, stream.byteOffset + stream.length), { normals: false });
  assert.equal(bare.normals, null);
  assert.deepEqual(bare.positions, mesh.positions);
  assert.deepEqual(bare.indices, mesh.indices);
});

test('errors carry a code and a sentence', async () => {
  const decoder = await createReliefDecoder();
  const altered = (at, value) => Uint8Array.from(stream, (byte, i) => (i === at ? value : byte));
  assert.equal(codeOf(() => decoder.decode(altered(0, 0))), 'MAGIC');
  assert.equal(codeOf(() => decoder.decode(altered(3, 99))), 'VERSION');
  assert.equal(codeOf(() => decoder.decode(new Uint8Array(0))), 'TRUNCATED');
  assert.equal(codeOf(() => decoder.decode(stream.subarray(0, 5))), 'TRUNCATED');
  assert.equal(codeOf(() => decoder.decode(stream, { limits: { maxVertices: 10 } })), 'LIMIT');
  assert.equal(codeOf(() => decoder.inspect(stream, { maxPatches: 0 })), 'LIMIT');
  assert.equal(codeOf(() => decoder.decode(stream, { limits: { maxPixels: -1 } })), 'ARGUMENT');
  assert.equal(codeOf(() => decoder.decode('RLF')), 'ARGUMENT');
  assert.equal(codeOf(() => decoder.decode(stream)), 'OK');
});

for (const [name, module] of Object.entries({ wasm, simd })) test(`every prefix decodes to a coarser mesh or says why not, and the next decode is right (${name})`, async () => {
  const decoder = await createReliefDecoder(module);
  const { masksEnd } = decoder.inspect(stream);
  const whole = decoder.decode(stream);
  for (let size = 0; size < stream.length; size += Math.ceil(stream.length / 400)) {
    const prefix = stream.slice(0, size);
    const code = codeOf(() => assertWellFormed(decoder.decode(prefix)));
    assert.equal(code, size < masksEnd ? 'TRUNCATED' : 'OK', `prefix of ${size} bytes`);
  }
  assert.deepEqual(decoder.decode(stream), whole);
});

for (const [name, module] of Object.entries({ wasm, simd })) test(`altered bytes never stop the module, and the next decode is right (${name})`, async () => {
  const decoder = await createReliefDecoder(module);
  const whole = decoder.decode(stream);
  let state = 12345;
  const random = n => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) % n;
  const seen = {};
  for (let round = 0; round < 1500; round++) {
    const bytes = stream.slice();
    for (let k = 0; k <= round % 3; k++) bytes[random(round % 2 ? bytes.length : 200)] = random(256);
    const code = codeOf(() => assertWellFormed(decoder.decode(bytes, { limits: { maxPixels: 1 << 22, maxVertices: 1 << 22 } })));
    assert.notEqual(code, 'INTERNAL', `round ${round}`);
    seen[code] = (seen[code] ?? 0) + 1;
  }
  assert.ok(seen.OK > 0 && Object.keys(seen).length > 1, JSON.stringify(seen));
  assert.deepEqual(decoder.decode(stream), whole);
});

test('memory that cannot grow is refused, and taken back afterwards', async () => {
  const { exports } = await WebAssembly.instantiate(await WebAssembly.compile(wasm));
  const first = exports.relief_wasm_allocate(100);
  assert.equal(first % 16, 0);
  assert.equal(exports.relief_wasm_allocate(0xffffffff), 0);
  assert.equal(exports.relief_wasm_allocate(0xfffffff0), 0);
  const second = exports.relief_wasm_allocate(16);
  assert.ok(second >= first + 100, 'a refused request changed what was handed out');
  exports.relief_wasm_reset();
  assert.equal(exports.relief_wasm_allocate(1 << 20), first);
  assert.ok(exports.memory.buffer.byteLength >= first + (1 << 20));
});

// A stream that promises one patch of 2048 x 1024 pixels, all of them in the mask, and so many of them on its border.
function greedyStream(nodes, tableBytes) {
  const header = new DataView(new ArrayBuffer(29));
  [0x52, 0x4c, 0x46, 0, 1].forEach((byte, i) => header.setUint8(i, byte));
  [0, 0, 0, 1, 8, 1].forEach((value, i) => header.setFloat32(5 + 4 * i, value, true));  // origin, scale, spacing, step
  const varint = value => (value < 128 ? [value] : [value % 128 + 128, ...varint(Math.floor(value / 128))]);
  const counts = [1, 2048 * 1024, nodes, 3, 1, tableBytes, 0, 0].flatMap(varint);
  const table = [128, 128, 64, 7, 255, 128, 31, 255, 128];  // the patch; of masks there is nothing
  return Uint8Array.from([...new Uint8Array(header.buffer), ...counts, ...table, ...new Array(tableBytes - table.length).fill(0)]);
}

test('a stream that asks for more memory than its size warrants is refused, whatever the limits', async () => {
  const decoder = await createReliefDecoder();
  const asked = bytes => {
    const info = decoder.inspect(bytes);
    assert.equal(info.pixelCount, 2048 * 1024);
    return info.workspaceBytes + 24 * info.vertexCapacity + 12 * info.triangleCapacity;
  };
  for (const tableBytes of [1000, 5000]) {
    const overdone = nodes => {
      const bytes = greedyStream(nodes, tableBytes);
      return asked(bytes) > 2 ** 30 + 2 ** 16 * bytes.length;
    };
    let few = 0, many = 2048 * 1024;  // the last number of nodes that is warranted, and the first that is not
    assert.ok(!overdone(few) && overdone(many));
    while (many - few > 1) {
      const middle = (few + many) >> 1;
      if (overdone(middle)) many = middle;
      else few = middle;
    }
    const below = greedyStream(few, tableBytes), above = greedyStream(many, tableBytes);
    assert.equal(codeOf(() => decoder.decode(above)), 'LIMIT');
    assert.equal(codeOf(() => decoder.decode(above, { limits: { maxVertices: 2 ** 32 - 1 } })), 'LIMIT');
    assert.equal(codeOf(() => decoder.decode(below)), 'CORRUPT');  // tried, and there are no masks
  }
  assert.equal(codeOf(() => decoder.decode(stream)), 'OK');
});

test('two decoders do not disturb each other', async () => {
  const [one, two] = [await createReliefDecoder(), await createReliefDecoder()];
  const expected = one.decode(stream);
  codeOf(() => two.decode(stream.subarray(0, 20)));
  assert.deepEqual(one.decode(stream), expected);
  assert.deepEqual(two.decode(stream), expected);
});
