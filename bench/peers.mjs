// Each peer: a list of settings, and how to get from a model to bytes and back to a mesh that can be measured.
import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
import path from 'node:path';
import zlib from 'node:zlib';
import { MeshoptDecoder, MeshoptSimplifier } from 'meshoptimizer';

import { compact, readGlb, root, writeObj, writePly } from './meshes.mjs';

export const build = path.resolve(root, process.env.RELIEF_BUILD ?? 'build/release');
export const RELIEF = path.join(build, 'encoder/relief');
const GLTFPACK = path.join(root, 'bench/node_modules/gltfpack/cli.js');

const OPTIONS = { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'], maxBuffer: 1 << 28, timeout: 1_800_000 };
export const run = (program, ...args) => execFileSync(program, args.map(String), OPTIONS);

// E_rms and E_max in 1e-4 of the diagonal and the mean deviation of normals in degrees, measured on the decoded file.
export function measure(model, decoded) {
  const result = JSON.parse(run(RELIEF, 'compare', model, decoded, '--json'));
  return { rms: result.e_rms, max: result.e_max, normals: result.normal_mean };
}

// Returns whether there is a stream: exit status 3, a target that could not be met, still leaves one; running into the
// time limit does not.
export function encode(ply, stream, error) {
  try {
    run(RELIEF, 'encode', ply, stream, '--error', error, '--no-colors', '--quiet');
    return true;
  } catch (failure) {
    if (failure.status !== 3 && failure.code !== 'ETIMEDOUT') throw failure;
    return failure.status === 3;
  }
}

// Calls `record` with { peer, settings, bytes, file } for every setting; `file` is the decoded mesh, removed afterwards.

export function relief({ ply, folder, quick, leftOut, errors = [6e-4, 4e-4, 2e-4, 1e-4, 0.5e-4, 0.35e-4, 0.25e-4] }, record) {
  for (const error of quick ? [4e-4, 1e-4] : errors) {
    const stream = path.join(folder, `relief-${error}.relief`), file = path.join(folder, 'relief.ply');
    const begin = performance.now();
    if (!encode(ply, stream, error)) {
      leftOut.push(`Relief --error ${error}: not done after ${OPTIONS.timeout / 60_000} minutes`);
      continue;
    }
    const seconds = (performance.now() - begin) / 1000;
    run(RELIEF, 'decode', stream, file, '--quiet');
    record({ peer: 'Relief', settings: `--error ${error}`, bytes: fs.statSync(stream).size, seconds, file });
  }
}

export function dracoRoundTrip(ply, bits, folder) {
  const drc = path.join(folder, 'peer.drc'), file = path.join(folder, 'peer-decoded.ply');
  run('draco_encoder', '-i', ply, '-o', drc, '-cl', 10, '-qp', bits);
  run('draco_decoder', '-i', drc, '-o', file);
  return { bytes: fs.statSync(drc).size, file };
}

export function draco({ ply, folder, quick }, record) {
  for (const bits of quick ? [10, 12] : [8, 9, 10, 11, 12, 13, 14]) {
    record({ peer: 'Draco', settings: `-cl 10 -qp ${bits}`, ...dracoRoundTrip(ply, bits, folder) });
  }
}

// Ratios with the position bits that lay on or near the lower hull of a full search (813 runs on Dragon and Igea).
const SIMPLIFY = [[0.008, [9, 10]], [0.0125, [9, 10, 11]], [0.025, [10, 11, 12]], [0.05, [11, 12]], [0.07, [11, 12]], [0.1, [12, 13]],
  [0.15, [12, 13]], [0.25, [12, 13]], [0.35, [13]], [0.5, [13, 14]]];

// The mesh with so much of its triangles.
export async function simplify(mesh, ratio) {
  await MeshoptSimplifier.ready;
  const positions = mesh.positions.slice(), indices = mesh.indices.slice();
  const target = 3 * Math.floor(indices.length / 3 * ratio);
  const noAttributes = [new Float32Array(positions.length / 3), 1, [0]];
  const [count] = MeshoptSimplifier.simplifyWithUpdate(indices, positions, 3, ...noAttributes, null, target, 1e9, []);
  return compact({ positions, indices: indices.slice(0, count) });
}

export async function simplifyDraco({ mesh, folder, quick, ratios = SIMPLIFY }, record) {
  for (const [ratio, bitsList] of quick ? ratios.filter((_, i) => i % 4 === 2) : ratios) {
    const ply = path.join(folder, 'simplified.ply');
    writePly(ply, await simplify(mesh, ratio));
    for (const bits of bitsList) {
      const settings = `simplifyWithUpdate ${ratio}, -cl 10 -qp ${bits}`;
      record({ peer: 'simplify + Draco', settings, ...dracoRoundTrip(ply, bits, folder) });
    }
    fs.rmSync(ply);
  }
}

const GLTFPACK_RATIOS = [[0.0125, [10, 11]], [0.025, [10, 11, 12]], [0.05, [11, 12]], [0.1, [11, 12, 13]], [0.15, [13]], [0.25, [13, 14]], [0.5, [14]], [1, [12, 14]]];

export async function gltfpack({ mesh, folder, quick }, record) {
  await MeshoptDecoder.ready;
  const obj = path.join(folder, 'model.obj'), glb = path.join(folder, 'gltfpack.glb'), file = path.join(folder, 'gltfpack.ply');
  writeObj(obj, mesh);
  for (const [ratio, bitsList] of quick ? GLTFPACK_RATIOS.slice(2, 3) : GLTFPACK_RATIOS) {
    for (const bits of bitsList) {
      const options = ['-cz', '-vp', bits, ...(ratio < 1 ? ['-si', ratio, '-se', 1, '-sv'] : [])];
      run('node', GLTFPACK, '-i', obj, '-o', glb, ...options);
      writePly(file, await readGlb(glb, MeshoptDecoder));
      const bytes = fs.readFileSync(glb);
      record({ peer: 'gltfpack', settings: options.join(' '), bytes: bytes.length, file });
      const zipped = zlib.gzipSync(bytes, { level: 9 }).length;
      record({ peer: 'gltfpack + gzip', settings: options.join(' '), bytes: zipped, file });
    }
  }
  fs.rmSync(obj);
}
