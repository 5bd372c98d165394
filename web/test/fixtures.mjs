// What the tests work on: small models made here, and larger ones where the machine has them.
import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { fileURLToPath } from 'node:url';

export const root = fileURLToPath(new URL('../..', import.meta.url));
export const build = path.resolve(root, process.env.RELIEF_BUILD ?? 'build/release');
export const outputs = path.join(root, 'build/web-tests');  // every GLB left here is validated at the end
fs.mkdirSync(outputs, { recursive: true });

const program = name => [path.join(build, 'encoder', name), path.join(build, 'tests', name)].find(file => fs.existsSync(file));

// Runs a program of the native build; throws with its stderr if it fails.
export function run(name, ...args) {
  const file = program(name);
  if (!file) throw new Error(`${name} is not built in ${build}`);
  return execFileSync(file, args, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'], maxBuffer: 1 << 28 });
}

// A closed, bumpy surface of 2 n^2 + 2 vertices, always the same.
export function bumpySphere(n, centre = [0, 0, 0], radius = 1) {
  const positions = [], triangles = [], columns = 2 * n;
  const add = (theta, phi) => {
    const bumps = 1 + 0.06 * Math.sin(7 * phi) * Math.sin(theta) ** 2 * Math.cos(5 * theta) + 0.03 * Math.cos(11 * theta);
    const r = radius * bumps;
    positions.push([centre[0] + r * Math.sin(theta) * Math.cos(phi), centre[1] + r * Math.sin(theta) * Math.sin(phi),
      centre[2] + r * Math.cos(theta)]);
  };
  for (let i = 0; i < n; i++) for (let j = 0; j < columns; j++) add((i + 1) * Math.PI / (n + 1), j * Math.PI / n);
  add(0, 0);
  add(Math.PI, 0);
  const at = (i, j) => i * columns + j % columns, north = n * columns, south = north + 1;
  for (let j = 0; j < columns; j++) {
    triangles.push([north, at(0, j), at(0, j + 1)], [south, at(n - 1, j + 1), at(n - 1, j)]);
    for (let i = 0; i + 1 < n; i++) {
      triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
    }
  }
  return { positions, triangles };
}

export function writePly(file, { positions, triangles, colors = null }) {
  const channels = colors ? ['red', 'green', 'blue'].map(name => `property uchar ${name}\n`).join('') : '';
  const header = `ply\nformat ascii 1.0\nelement vertex ${positions.length}\nproperty float x\nproperty float y\n` +
    `property float z\n${channels}element face ${triangles.length}\nproperty list uchar int vertex_indices\nend_header\n`;
  fs.writeFileSync(file, header + positions.map((p, i) => [...p, ...(colors?.[i] ?? [])].join(' ') + '\n').join('') +
    triangles.map(t => `3 ${t.join(' ')}\n`).join(''));
}

const temporary = fs.mkdtempSync(path.join(os.tmpdir(), 'relief-web-'));
process.on('exit', () => fs.rmSync(temporary, { recursive: true, force: true }));
export const scratch = name => path.join(temporary, name);

// Encodes a model file to a file in `outputs` and returns its name. A file newer than the encoder and the model is kept.
export function encode(input, name, ...options) {
  const output = path.join(outputs, name);
  const age = file => fs.statSync(file, { throwIfNoEntry: false })?.mtimeMs ?? 0;
  if (age(output) <= Math.max(age(program('relief')), age(input))) {
    run('relief', 'encode', input, output, '--quiet', ...options);
  }
  return output;
}

const sphere = path.join(outputs, 'sphere.ply');
if (!fs.existsSync(sphere)) writePly(sphere, bumpySphere(90));
export const sphereFile = () => sphere;
export const sphereGlb = () => encode(sphere, 'sphere.glb', '--error', '5e-4');
export const fineSphereGlb = () => encode(sphere, 'fine-sphere.glb', '--error', '2e-5');

// The sphere in bands of colour.
export function paintedGlb() {
  const file = path.join(outputs, 'painted.ply');
  if (!fs.existsSync(file)) {
    const mesh = bumpySphere(60);
    const byte = v => Math.round(128 + 127 * v);
    mesh.colors = mesh.positions.map(([x, y, z]) => [byte(Math.sin(5 * x)), byte(Math.sin(4 * y + 1)), byte(Math.cos(3 * z))]);
    writePly(file, mesh);
  }
  return encode(file, 'painted.glb', '--error', '5e-4');
}

// A model at the default error.
export const modelGlb = (name, file) => encode(file, `${name}-1e-4.glb`, '--error', '1e-4');

// [name, file or null]: models of realistic size. Null where the machine does not have it.
export function largeModels() {
  const shared = process.env.RELIEF_MODELS ?? path.join(root, '../shared/models/scan');
  const files = {
    bunny: path.join(shared, 'bunny.ply'),
    igea: path.join(shared, 'igea.ply'),
    dragon: path.join(root, 'build/models/dragon.ply'),  // put there by tools/demo and tools/test
  };
  return Object.entries(files).map(([name, file]) => [name, fs.existsSync(file) ? file : null]);
}

export function readGlb(file) {
  const bytes = fs.readFileSync(file);
  const jsonLength = bytes.readUInt32LE(12);
  const json = JSON.parse(bytes.toString('utf8', 20, 20 + jsonLength));
  return { json, binary: bytes.subarray(28 + jsonLength) };
}

export function writeGlb(file, json, binary) {
  const pad = (buffer, fill) => Buffer.concat([buffer, Buffer.alloc(-buffer.length & 3, fill)]);
  const chunks = [[0x4e4f534a, pad(Buffer.from(JSON.stringify(json)), 0x20)], [0x004e4942, pad(Buffer.from(binary), 0)]];
  const parts = chunks.flatMap(([type, data]) => {
    const head = Buffer.alloc(8);
    head.writeUInt32LE(data.length, 0);
    head.writeUInt32LE(type, 4);
    return [head, data];
  });
  const head = Buffer.from('glTF\x02\0\0\0\0\0\0\0', 'latin1');
  head.writeUInt32LE(12 + parts.reduce((sum, part) => sum + part.length, 0), 8);
  fs.writeFileSync(file, Buffer.concat([head, ...parts]));
}

// The streams of a GLB, in the order of its primitives.
export function streamsOf(file) {
  const { json, binary } = readGlb(file);
  return json.meshes.flatMap(mesh => mesh.primitives).flatMap(primitive => {
    const extension = primitive.extensions?.RELIEF_patch_compression;
    if (!extension) return [];
    const { byteOffset = 0, byteLength } = json.bufferViews[extension.bufferView];
    return [new Uint8Array(binary.subarray(byteOffset, byteOffset + byteLength))];
  });
}

// The sphere drawn as points.
export function pointsGlb() {
  const { json, binary } = readGlb(sphereGlb());
  const primitive = json.meshes[0].primitives[0];
  primitive.mode = 0;
  json.accessors.splice(primitive.indices, 1);  // the last one
  delete primitive.indices;
  const file = path.join(outputs, 'points.glb');
  writeGlb(file, json, binary);
  return file;
}

// A scene with: a mesh of one compressed and one plain primitive, used by two nodes; materials; names; a light node.
export function mixedGlb() {
  const { json, binary } = readGlb(sphereGlb());
  const triangle = Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer);
  const padded = Buffer.concat([binary, Buffer.alloc(-binary.length & 3)]);
  json.bufferViews.push({ buffer: 0, byteOffset: padded.length, byteLength: triangle.length });
  json.accessors.push({ bufferView: json.bufferViews.length - 1, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] });
  json.buffers[0].byteLength = padded.length + triangle.length;
  json.materials = [{ name: 'bronze', pbrMetallicRoughness: { baseColorFactor: [0.5, 0.25, 0.125, 1] } }, { name: 'paper' }];
  json.meshes[0].name = 'statue';
  json.meshes[0].primitives[0].material = 0;
  json.meshes[0].primitives.push({ attributes: { POSITION: json.accessors.length - 1 }, material: 1 });
  json.nodes = [{ name: 'left', mesh: 0, translation: [-2, 0, 0] }, { name: 'right', mesh: 0 }, { name: 'empty', extras: { kept: 7 } }];
  json.scenes = [{ nodes: [0, 1, 2] }];
  json.scene = 0;
  const file = path.join(outputs, 'mixed.glb');
  writeGlb(file, json, Buffer.concat([padded, triangle]));
  return file;
}

// The sphere's GLB after alter(json, primitive, bytes, where the stream begins in them), which should make it contradict itself.
export function alteredGlb(alter) {
  const { json, binary } = readGlb(sphereGlb());
  const bytes = Buffer.from(binary), primitive = json.meshes[0].primitives[0];
  alter(json, primitive, bytes, json.bufferViews[primitive.extensions.RELIEF_patch_compression.bufferView].byteOffset ?? 0);
  const file = scratch('altered.glb');
  writeGlb(file, json, bytes);
  return file;
}
