// Decode times in turns: Draco's and Relief's native programs, then the WebAssembly decoders in Node. By itself, without a
// whole bench: node decode_times.mjs MODEL.ply
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import draco3d from 'draco3d';
import { MeshoptDecoder, MeshoptEncoder } from 'meshoptimizer';

import { readPly, root, writePly } from './meshes.mjs';
import { build, encode, run } from './peers.mjs';
import { createReliefDecoder } from '../web/dist/relief.mjs';

const ROUNDS = 11, WARM_UP = 2;

const median = values => [...values].sort((a, b) => a - b)[values.length >> 1];
const summary = values => ({ median: median(values), min: Math.min(...values), max: Math.max(...values), rounds: values.length });

// Runs all contestants once a round; returns { name: { median, min, max, rounds } } of milliseconds.
function inTurns(contestants, rounds) {
  const times = Object.fromEntries(Object.keys(contestants).map(name => [name, []]));
  for (let round = -WARM_UP; round < rounds; round++) {
    for (const [name, once] of Object.entries(contestants)) {
      const milliseconds = once();
      if (round >= 0) times[name].push(milliseconds);
    }
  }
  return Object.fromEntries(Object.entries(times).map(([name, values]) => [name, summary(values)]));
}

// Processor time, which other programs on the machine disturb little.
const timed = call => {
  const begin = process.cpuUsage();
  call();
  const { user, system } = process.cpuUsage(begin);
  return (user + system) / 1000;
};

// Fresh memory is most of what a decode waits for: both also with glibc's large pages, as other allocators have them.
function native(stream, drc, folder) {
  const decodeTime = path.join(build, 'bench/decode_time');
  // Draco's output goes nowhere: written pages would be counted to the program that runs next
  const nowhere = path.join(folder, 'nowhere.ply');
  fs.symlinkSync('/dev/null', nowhere);
  const milliseconds = (text, pattern) => Number(pattern.exec(text)[1]);
  const contestants = (name, environment) => ({
    [`Draco, native${name}`]: () =>
      milliseconds(run('env', ...environment, 'draco_decoder', '-i', drc, '-o', nowhere), /\((\d+) ms to decode\)/),
    [`Relief, native${name}`]: () => milliseconds(run('env', ...environment, decodeTime, stream), /^([\d.]+) ms/),
  });
  return inTurns({ ...contestants('', []), ...contestants(', large pages', ['GLIBC_TUNABLES=glibc.malloc.hugetlb=1']) }, ROUNDS);
}

// Draco's own usage: decode, then fetch positions and indices.
function dracoDecode(module, bytes) {
  const decoder = new module.Decoder(), mesh = new module.Mesh();
  const status = decoder.DecodeArrayToMesh(bytes, bytes.length, mesh);
  if (!status.ok()) throw new Error(status.error_msg());
  const indexBytes = 12 * mesh.num_faces(), positionBytes = 12 * mesh.num_points();
  const indexAt = module._malloc(indexBytes), positionAt = module._malloc(positionBytes);
  decoder.GetTrianglesUInt32Array(mesh, indexBytes, indexAt);
  decoder.GetAttributeDataArrayForAllPoints(mesh, decoder.GetAttribute(mesh, decoder.GetAttributeId(mesh, module.POSITION)),
    module.DT_FLOAT32, positionBytes, positionAt);
  const result = [new Uint32Array(module.HEAPF32.buffer, indexAt, indexBytes / 4).slice(),
    new Float32Array(module.HEAPF32.buffer, positionAt, positionBytes / 4).slice()];
  for (const address of [indexAt, positionAt]) module._free(address);
  for (const object of [mesh, decoder]) module.destroy(object);
  return result;
}

// meshopt on 12-bit positions of the same model, as gltfpack stores it without simplification.
async function meshoptContestant({ positions, indices }) {
  await Promise.all([MeshoptDecoder.ready, MeshoptEncoder.ready]);
  const [remap, unique] = MeshoptEncoder.reorderMesh(indices.slice(), true, true);
  const ordered = new Uint16Array(4 * unique), triangles = indices.map(vertex => remap[vertex]);
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  positions.forEach((x, i) => { low[i % 3] = Math.min(low[i % 3], x); high[i % 3] = Math.max(high[i % 3], x); });
  const scale = 4095 / Math.max(...high.map((x, k) => x - low[k]));
  remap.forEach((to, from) => {
    if (to < unique) for (let k = 0; k < 3; k++) ordered[4 * to + k] = Math.round((positions[3 * from + k] - low[k]) * scale);
  });
  const vertexBytes = MeshoptEncoder.encodeVertexBuffer(new Uint8Array(ordered.buffer), unique, 8);
  const indexBytes = MeshoptEncoder.encodeIndexBuffer(new Uint8Array(triangles.buffer), triangles.length, 4);
  return () => timed(() => {
    MeshoptDecoder.decodeVertexBuffer(new Uint8Array(8 * unique), unique, 8, vertexBytes);
    MeshoptDecoder.decodeIndexBuffer(new Uint8Array(4 * triangles.length), triangles.length, 4, indexBytes);
  });
}

export async function decodeTimes({ ply, mesh, folder }) {
  const stream = path.join(folder, 'timed.relief'), drc = path.join(folder, 'timed.drc');
  encode(ply, stream, 1e-4);
  run('draco_encoder', '-i', ply, '-o', drc, '-cl', 10, '-qp', 12);
  const nativeTimes = native(stream, drc, folder);

  const streamBytes = new Uint8Array(fs.readFileSync(stream)), dracoBytes = new Uint8Array(fs.readFileSync(drc));
  const reliefDecoder = await createReliefDecoder();
  const withoutSimd = await createReliefDecoder({ module: fs.readFileSync(path.join(root, 'wasm/dist/relief.wasm')) });
  const dracoModule = await draco3d.createDecoderModule({});
  const wasmTimes = inTurns({
    'Draco, WebAssembly': () => timed(() => dracoDecode(dracoModule, dracoBytes)),
    'Relief, WebAssembly': () => timed(() => reliefDecoder.decode(streamBytes, { normals: false })),
    'Relief, WebAssembly without SIMD': () => timed(() => withoutSimd.decode(streamBytes, { normals: false })),
    'Relief with normals, WebAssembly': () => timed(() => reliefDecoder.decode(streamBytes)),
    'meshopt, WebAssembly': await meshoptContestant(mesh),
  }, ROUNDS);
  const { vertexCount, triangleCount } = reliefDecoder.inspect(streamBytes);
  return { times: { ...nativeTimes, ...wasmTimes }, reliefBytes: streamBytes.length, dracoBytes: dracoBytes.length, vertexCount, triangleCount };
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'relief-decode-'));
  try {
    const mesh = readPly(process.argv[2]), ply = path.join(folder, 'model.ply');
    writePly(ply, mesh);
    const { times, reliefBytes, dracoBytes, vertexCount } = await decodeTimes({ ply, mesh, folder });
    console.log(`Relief: ${reliefBytes} bytes, ${vertexCount} vertices decoded; Draco: ${dracoBytes} bytes, ${mesh.positions.length / 3} vertices`);
    for (const [who, { median, min }] of Object.entries(times)) console.log(`${who}: ${median.toFixed(1)} ms (least ${min.toFixed(1)})`);
  } finally {
    fs.rmSync(folder, { recursive: true });
  }
}
