// Relief: decoder for RELIEF_patch_compression, for browsers and Node. Types and contract: relief.d.ts.
//
//   const relief = await createReliefDecoder();
//   const { positions, normals, indices } = relief.decode(bytes);

const STATUS = ['OK', 'ARGUMENT', 'TRUNCATED', 'MAGIC', 'VERSION', 'CORRUPT', 'LIMIT', 'WORKSPACE', 'OUTPUT'];
const LIMITS_BYTES = 12, INFO_BYTES = 64, MESH_BYTES = 28;  // sizes of the C structures, checked in exports.cpp
const DEFAULT_LIMITS = { maxPatches: 2 ** 20, maxPixels: 2 ** 28, maxVertices: 2 ** 27 };
// What a stream may ask for, as in the C++ library: the limits let a few bytes ask for more than a machine has. Scans take
// some KB for each byte of their streams.
const MOST_BYTES = 2 ** 30, MOST_BYTES_A_BYTE = 2 ** 16;
const KEEP_BYTES = 64 << 20;  // WebAssembly memory never shrinks: an instance that grew beyond this is let go

export class ReliefError extends Error {
  constructor(code, message) {
    super(message);
    this.name = 'ReliefError';
    this.code = code;
  }
}

// A function that splats an i32 and counts bits: valid where WebAssembly has vectors.
const SIMD_PROBE = Uint8Array.of(0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11);

// Both addresses stand here in full, so that bundlers find the files.
function moduleBeside() {
  return WebAssembly.validate(SIMD_PROBE) ? new URL('./relief-simd.wasm', import.meta.url) : new URL('./relief.wasm', import.meta.url);
}

export async function createReliefDecoder(source = moduleBeside()) {
  const module = source instanceof WebAssembly.Module ? source : await WebAssembly.compile(await readBytes(source));
  const state = { module, instance: null };
  state.instance = await WebAssembly.instantiate(module);
  return {
    inspect: (stream, limits) => guarded(state, wasm => inspect(wasm, place(wasm, stream, limits))),
    decode: (stream, options) => guarded(state, wasm => decode(wasm, stream, options ?? {})),
  };
}

async function readBytes(source) {
  if (source instanceof ArrayBuffer || ArrayBuffer.isView(source)) return source;
  const url = source instanceof URL ? source : new URL(source, globalThis.document?.baseURI ?? import.meta.url);
  if (url.protocol === 'file:') {
    const fs = await import(/* @vite-ignore */ 'node:' + 'fs/promises');
    return fs.readFile(url);
  }
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url.href}: HTTP status ${response.status}`);
  return response.arrayBuffer();
}

// Runs one call. Whatever happens in it, the next call finds the module as good as new.
function guarded(state, call) {
  state.instance ??= new WebAssembly.Instance(state.module);  // needs no _initialize: the decoder has no constructors
  const wasm = state.instance.exports;
  try {
    return call(wasm);
  } catch (error) {
    if (error instanceof ReliefError) throw error;
    state.instance = null;  // a trap leaves the stack pointer where it was
    if (error instanceof WebAssembly.RuntimeError) throw new ReliefError('INTERNAL', `decoder stopped: ${error.message}`);
    if (error instanceof RangeError) throw new ReliefError('MEMORY', `not enough memory for the mesh: ${error.message}`);
    throw error;
  } finally {
    if (wasm.memory.buffer.byteLength > KEEP_BYTES) state.instance = null;
    else wasm.relief_wasm_reset();
  }
}

function allocate(wasm, bytes) {
  const address = bytes < 2 ** 32 ? wasm.relief_wasm_allocate(bytes) >>> 0 : 0;
  if (address === 0) throw new ReliefError('MEMORY', `not enough memory: the stream needs ${bytes} bytes more`);
  return address;
}

// Copies a stream and the limits into the module.
function place(wasm, stream, limits) {
  const bytes = stream instanceof ArrayBuffer ? new Uint8Array(stream) : stream;
  if (!(bytes instanceof Uint8Array)) throw new ReliefError('ARGUMENT', 'the stream must be a Uint8Array or an ArrayBuffer');
  const all = { ...DEFAULT_LIMITS, ...limits };
  const values = [all.maxPatches, all.maxPixels, all.maxVertices];
  if (!values.every(v => Number.isInteger(v) && v >= 0 && v < 2 ** 32)) {
    throw new ReliefError('ARGUMENT', 'limits must be whole numbers from 0 to 4294967295');
  }
  const data = allocate(wasm, Math.max(bytes.length, 1));
  const limitsAt = allocate(wasm, LIMITS_BYTES);
  new Uint8Array(wasm.memory.buffer).set(bytes, data);
  new Uint32Array(wasm.memory.buffer, limitsAt, 3).set(values);
  return { data, size: bytes.length, limits: limitsAt };
}

function check(wasm, status) {
  if (status === 0) return;
  const memory = new Uint8Array(wasm.memory.buffer);
  const begin = wasm.relief_status_text(status) >>> 0;
  const end = memory.indexOf(0, begin);
  throw new ReliefError(STATUS[status] ?? 'INTERNAL', new TextDecoder().decode(memory.slice(begin, end)));
}

function inspect(wasm, input) {
  const at = allocate(wasm, INFO_BYTES);
  check(wasm, wasm.relief_inspect(input.data, input.size, input.limits, at));
  const view = new DataView(wasm.memory.buffer, at, INFO_BYTES);
  const u32 = offset => view.getUint32(offset, true);
  const f32 = offset => view.getFloat32(offset, true);
  return {
    version: u32(0), patchCount: u32(4), pixelCount: u32(8), vertexCount: u32(12), triangleCount: u32(16),
    vertexCapacity: u32(20), triangleCapacity: u32(24), workspaceBytes: Number(view.getBigUint64(32, true)),
    origin: [f32(40), f32(44), f32(48)], scale: f32(52), masksEnd: u32(56),
  };
}

function decode(wasm, stream, { normals = true, limits }) {
  const input = place(wasm, stream, limits);
  const info = inspect(wasm, input);
  const asked = info.workspaceBytes + 24 * info.vertexCapacity + 12 * info.triangleCapacity;
  if (asked > MOST_BYTES + MOST_BYTES_A_BYTE * input.size) {
    throw new ReliefError('LIMIT', 'the stream asks for more memory than one of its size may');
  }
  const positionsAt = allocate(wasm, info.vertexCapacity * 12);
  const normalsAt = normals ? allocate(wasm, info.vertexCapacity * 12) : 0;
  const indicesAt = allocate(wasm, info.triangleCapacity * 12);
  const meshAt = allocate(wasm, MESH_BYTES);
  const workspaceAt = allocate(wasm, info.workspaceBytes);
  const mesh = [positionsAt, normalsAt, indicesAt, info.vertexCapacity, info.triangleCapacity, 0, 0];
  new Uint32Array(wasm.memory.buffer, meshAt, 7).set(mesh);
  check(wasm, wasm.relief_decode(input.data, input.size, input.limits, meshAt, workspaceAt, info.workspaceBytes));

  const memory = wasm.memory.buffer;
  const [vertexCount, triangleCount] = new Uint32Array(memory, meshAt + 20, 2);
  if (vertexCount > info.vertexCapacity || triangleCount > info.triangleCapacity) {
    throw new ReliefError('INTERNAL', 'the decoder wrote more than it announced');
  }
  return {
    positions: new Float32Array(memory, positionsAt, 3 * vertexCount).slice(),
    normals: normals ? new Float32Array(memory, normalsAt, 3 * vertexCount).slice() : null,
    indices: new Uint32Array(memory, indicesAt, 3 * triangleCount).slice(),
    vertexCount,
    triangleCount,
  };
}
