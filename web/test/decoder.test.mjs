// The WebAssembly decoder through its loader: size, errors, recovery.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import fs from 'node:fs';
import zlib from 'node:zlib';
import test from 'node:test';
import { createReliefDecoder, ReliefError } from 'relief-gltf';

import { fineSphereGlb, sphereGlb, streamsOf } from './fixtures.mjs';

const wasm = fs.readFileSync(new URL('../../wasm/dist/relief.wasm', import.meta.url));
const simd = fs.readFileSync(new URL('../../wasm/dist/relief-simd.wasm', import.meta.url));
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

test('the modules import nothing and all keep to their budgets', () => {
  const file = fs.readFileSync(new URL('../dist/relief.mjs', import.meta.url));
  const budget = JSON.parse(fs.readFileSync(new URL('../../wasm/budget.json', import.meta.url)));
  assert.ok(zlib.gzipSync(file, { level: 9 }).length <= budget.gzip);
  for (const [bytes, most] of [[wasm, budget.plain], [simd, budget.simd]]) {
    assert.deepEqual(WebAssembly.Module.imports(new WebAssembly.Module(bytes)), []);
    assert.ok(bytes.length <= most, `${bytes.length} bytes`);
  }
});

test('the module with vectors is taken where there are vectors, else the other one, each whole', async () => {
  const { validate, compile } = WebAssembly, taken = [];
  WebAssembly.compile = bytes => (taken.push(Buffer.from(bytes)), compile(bytes));
  try {
    await createReliefDecoder();
    WebAssembly.validate = () => false;
    await createReliefDecoder();
  } finally {
    Object.assign(WebAssembly, { validate, compile });
  }
  assert.ok(taken[0].equals(simd) && taken[1].equals(wasm) && taken.length === 2);
});

test('both modules give the same mesh, whole and from prefixes', async () => {
  const [plain, vectors] = await Promise.all([wasm, simd].map(module => createReliefDecoder({ module })));
  const { masksEnd } = plain.inspect(stream);
  for (const size of [masksEnd, (masksEnd + stream.length) >> 1, stream.length]) {
    assert.deepEqual(vectors.decode(stream.slice(0, size)), plain.decode(stream.slice(0, size)));
  }
});

test('the decoder can be made from bytes and from a module', async () => {
  for (const module of [wasm, simd, new Uint8Array(wasm).buffer, await WebAssembly.compile(wasm), undefined]) {
    const decoder = await createReliefDecoder({ module });
    assert.equal(decoder.inspect(stream).version, 0);
  }
  await assert.rejects(createReliefDecoder({ module: stream }), WebAssembly.CompileError);
});

test('coarser levels, points, and some of the patches', async () => {
  const decoder = await createReliefDecoder();
  const whole = decoder.decode(stream), { patchCount } = decoder.inspect(stream);
  let before = whole.vertexCount;
  for (const level of [1, 2, 3, 4]) {
    const mesh = decoder.decode(stream, { level });
    assertWellFormed(mesh);
    assert.ok(mesh.vertexCount > 0 && mesh.vertexCount < before / 2, `${mesh.vertexCount} of ${before}`);
    assert.ok(mesh.vertexCount <= decoder.inspect(stream, { level }).vertexCapacity);
    before = mesh.vertexCount;
  }
  const points = decoder.decode(stream, { points: true });
  assert.equal(points.indices.length, 0);
  assert.deepEqual(points.positions, whole.positions.slice(0, 3 * points.vertexCount));
  const counts = Array.from({ length: patchCount }, (_, wanted) =>
    decoder.decode(stream, { points: true, patches: Array.from({ length: patchCount }, (_, i) => i === wanted) }).vertexCount);
  assert.equal(counts.reduce((a, b) => a + b), points.vertexCount);
  assert.deepEqual(decoder.decode(stream, { patches: new Uint8Array(patchCount).fill(1) }), whole);
  assert.equal(codeOf(() => decoder.decode(stream, { patches: [true] })), patchCount === 1 ? 'OK' : 'ARGUMENT');
  for (const level of [5, -1, 0.5, 'x']) assert.equal(codeOf(() => decoder.decode(stream, { level })), 'ARGUMENT');
  for (let axis = 0; axis < 3; axis++) {
    const values = whole.positions.filter((_, i) => i % 3 === axis);
    assert.equal(values.reduce((a, b) => Math.min(a, b)), whole.min[axis]);
    assert.equal(values.reduce((a, b) => Math.max(a, b)), whole.max[axis]);
  }
});

// The code of what a promise is rejected with, or 'OK'.
const codeOfPromise = promise => promise.then(() => 'OK', error => (assert.ok(error instanceof ReliefError, error.stack), error.code));

test('workers decode side by side what one thread decodes, bad streams among them', async () => {
  const decoder = await createReliefDecoder({ workers: 2 });
  try {
    const expected = decoder.decode(stream), coarse = decoder.decode(stream, { level: 2, normals: false });
    const kept = stream.slice();
    for (let round = 0; round < 3; round++) {
      const results = await Promise.allSettled([
        decoder.decodeAsync(stream), decoder.decodeAsync(stream.subarray(0, 20)), decoder.decodeAsync(stream, { level: 2, normals: false }),
        decoder.decodeAsync('RLF'), decoder.decodeAsync(stream, { limits: { maxVertices: 3 } }), decoder.decodeAsync(stream),
        decoder.decodeAsync(Buffer.from(stream)),
      ]);
      assert.deepEqual(results.map(({ reason }) => reason?.code), [undefined, 'TRUNCATED', undefined, 'ARGUMENT', 'LIMIT', undefined, undefined]);
      for (const i of [0, 5, 6]) assert.deepEqual(results[i].value, expected);
      assert.deepEqual(results[2].value, coarse);
    }
    assert.deepEqual(stream, kept, 'the stream stays the caller\'s');
  } finally {
    decoder.dispose();
  }
  assert.equal(await codeOfPromise(decoder.decodeAsync(stream)), 'ARGUMENT');
});

test('a disposed decoder rejects what is under way; a worker that fails does not keep the others', async () => {
  const decoder = await createReliefDecoder({ workers: 1 });
  const pending = [1, 2, 3].map(() => codeOfPromise(decoder.decodeAsync(stream)));
  decoder.dispose();
  for (const code of await Promise.all(pending)) assert.ok(['ARGUMENT', 'INTERNAL'].includes(code), code);
  const empty = await createReliefDecoder({ workers: 1, module: Uint8Array.of(0, 97, 115, 109, 1, 0, 0, 0) });
  assert.equal(await codeOfPromise(empty.decodeAsync(stream)), 'INTERNAL');
  assert.equal(await codeOfPromise(empty.decodeAsync(stream)), 'INTERNAL');
  empty.dispose();
});

test('without workers decodeAsync is decode', async () => {
  const decoder = await createReliefDecoder();
  assert.deepEqual(await decoder.decodeAsync(stream), decoder.decode(stream));
  assert.equal(await codeOfPromise(decoder.decodeAsync(stream.subarray(0, 9))), 'TRUNCATED');
  decoder.dispose();
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
  assert.equal(codeOf(() => decoder.inspect(stream, { limits: { maxPatches: 0 } })), 'LIMIT');
  assert.equal(codeOf(() => decoder.decode(stream, { limits: { maxPixels: -1 } })), 'ARGUMENT');
  assert.equal(codeOf(() => decoder.decode('RLF')), 'ARGUMENT');
  assert.equal(codeOf(() => decoder.decode(stream)), 'OK');
});

for (const [name, module] of Object.entries({ wasm, simd })) test(`every prefix decodes to a coarser mesh or says why not, and the next decode is right (${name})`, async () => {
  const decoder = await createReliefDecoder({ module });
  const { masksEnd } = decoder.inspect(stream);
  const whole = decoder.decode(stream);
  let least = Infinity;
  for (let size = 0; size < stream.length; size += Math.ceil(stream.length / 400)) {
    const prefix = stream.slice(0, size);
    const code = codeOf(() => assertWellFormed(decoder.decode(prefix)));
    if (code === 'OK') least = Math.min(least, size);
    assert.equal(code, size < least ? 'TRUNCATED' : 'OK', `prefix of ${size} bytes`);
  }
  assert.ok(least < masksEnd);
  assert.deepEqual(decoder.decode(stream), whole);
});

const goldenFile = name => fs.readFileSync(new URL(`../../tests/golden/${name}`, import.meta.url));
const golden = goldenFile('golden.txt').toString().split('\n').filter(line => line && line[0] !== '#')
  .map(line => line.split(' ')).map(([name, hash]) => ({ name, hash, stream: new Uint8Array(goldenFile(`${name}.relief`)) }));

for (const [name, module] of Object.entries({ wasm, simd })) test(`the golden streams decode to their hashes (${name})`, async () => {
  const decoder = await createReliefDecoder({ module });
  assert.ok(golden.some(one => one.name.startsWith('bisk')));
  for (const { name, hash, stream } of golden) {
    const { positions, normals, indices, colors } = decoder.decode(stream);
    const sha = createHash('sha256');
    for (const array of [positions, normals, indices, colors].filter(Boolean)) sha.update(new Uint8Array(array.buffer));
    assert.equal(sha.digest('hex'), hash, name);
  }
});

for (const [name, module] of Object.entries({ wasm, simd })) test(`a stream that arrives in pieces gives the mesh of each prefix (${name})`, async () => {
  const decoder = await createReliefDecoder({ module });
  for (const whole of [stream, ...golden.map(one => one.stream)]) {
    const { masksEnd } = decoder.inspect(whole), isLongEnough = prefix => codeOf(() => decoder.inspect(prefix)) !== 'TRUNCATED';
    for (const options of [undefined, { level: 1, normals: false }, { points: true }]) {
      const incremental = decoder.incremental(options);
      for (let size = 0, step = 1; size < whole.length; step = (step * 5) % 307) {
        const end = Math.min(size + step, whole.length), wanted = step % 3 > 0;
        const mesh = incremental.push(whole.subarray(size, end), { mesh: wanted });
        size = end;
        const expected = wanted && (size >= masksEnd || isLongEnough(whole.subarray(0, size))) ? decoder.decode(whole.subarray(0, size), options) : null;
        assert.deepEqual(mesh, expected?.vertexCount > 0 ? expected : null, `${size} bytes`);
      }
      assert.deepEqual(incremental.push(new Uint8Array(0)), decoder.decode(whole, options));
    }
  }
});

test('an incremental decoder that failed says so again, and others go on', async () => {
  const decoder = await createReliefDecoder();
  const [bad, long, good] = [1, 2, 3].map(() => decoder.incremental());
  assert.equal(codeOf(() => bad.push(Uint8Array.of(82, 0))), 'MAGIC');
  assert.equal(codeOf(() => bad.push(stream)), 'MAGIC');
  assert.notEqual(long.push(stream), null);
  assert.equal(codeOf(() => long.push(Uint8Array.of(0))), 'CORRUPT');  // a byte too many
  assert.equal(codeOf(() => decoder.incremental().push('RLF')), 'ARGUMENT');
  assert.deepEqual(good.push(stream.buffer.slice(stream.byteOffset, stream.byteOffset + stream.length)), decoder.decode(stream));
});

for (const [name, module] of Object.entries({ wasm, simd })) test(`altered bytes never stop the module, and the next decode is right (${name})`, async () => {
  const decoder = await createReliefDecoder({ module });
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

// What it is taken to need (bitstream.md, section 14).
function needed(nodes) {
  let planes = 0, [w, h] = [2048, 1024];
  const add = (width, height) => { planes += (width + 4) * (height + 4); };
  add(w, h);
  for (let level = 0; level < 5; level++, [w, h] = [(w + 1) >> 1, (h + 1) >> 1]) {
    add(w >> 1, (h + 1) >> 1);
    add((w + 1) >> 1, h >> 1);
    add(w >> 1, h >> 1);
    add((w + 1) >> 1, (h + 1) >> 1);
  }
  return 2 ** 23 + 320 + 5 * planes + (80 + 116) * 2048 * 1024 + 1200 * nodes;
}

test('a stream that asks for more memory than its size warrants is refused, unless the caller allows it', async () => {
  const decoder = await createReliefDecoder();
  for (const tableBytes of [1000, 5000]) {
    const size = greedyStream(2 ** 19, tableBytes).length;  // as many bytes as for other numbers of nodes
    const most = Math.floor((2 ** 30 + 2 ** 16 * size - needed(0)) / 1200);
    const below = greedyStream(most, tableBytes), above = greedyStream(most + 1, tableBytes);
    assert.deepEqual([below.length, above.length], [size, size]);
    for (const call of [s => decoder.decode(s), s => decoder.inspect(s), s => decoder.decode(s, { limits: { maxVertices: 2 ** 32 - 1 } })]) {
      assert.equal(codeOf(() => call(above)), 'LIMIT');
    }
    assert.equal(codeOf(() => decoder.inspect(below)), 'OK');
    const maxMemory = needed(most + 1);
    assert.equal(codeOf(() => decoder.inspect(above, { limits: { maxMemory } })), 'OK');
    assert.equal(codeOf(() => decoder.inspect(above, { limits: { maxMemory: maxMemory - 1 } })), 'LIMIT');
    if (tableBytes === 1000) assert.equal(codeOf(() => decoder.decode(below)), 'CORRUPT');  // tried, and there are no masks
  }
  assert.equal(codeOf(() => decoder.decode(stream)), 'OK');
});

// The module with no more memory than so many pages, below 128 * 128.
function withPages(pages) {
  const bytes = Uint8Array.from(wasm), most = [0x80, 0x80, 0x04];  // 65536, the memory's maximum
  const at = Buffer.from(bytes).indexOf(Uint8Array.of(...most));
  bytes.set([pages % 128 + 128, (pages >> 7) + 128, 0], at);
  return bytes;
}

test('a failed allocation is an error, and the next decode is right, here and in workers', async () => {
  const small = new Uint8Array(fs.readFileSync(new URL('../../tests/golden/one-patch.relief', import.meta.url)));
  const expected = (await createReliefDecoder()).decode(small);
  const large = streamsOf(fineSphereGlb())[0];
  const decoder = await createReliefDecoder({ module: withPages(32), workers: 2 });
  for (let round = 0; round < 3; round++) {
    assert.equal(codeOf(() => decoder.decode(large)), 'MEMORY');
    assert.deepEqual(decoder.decode(small), expected);
    const got = await Promise.allSettled([large, small, large, small].map(bytes => decoder.decodeAsync(bytes)));
    assert.deepEqual(got.map(({ reason, value }) => reason?.code ?? value), ['MEMORY', expected, 'MEMORY', expected]);
  }
  decoder.dispose();
});

test('two decoders do not disturb each other', async () => {
  const [one, two] = [await createReliefDecoder(), await createReliefDecoder()];
  const expected = one.decode(stream);
  codeOf(() => two.decode(stream.subarray(0, 20)));
  assert.deepEqual(one.decode(stream), expected);
  assert.deepEqual(two.decode(stream), expected);
});
