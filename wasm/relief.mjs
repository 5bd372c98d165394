// Relief: decoder for RELIEF_patch_compression, for browsers and Node. Types and contract: relief.d.ts.
//
//   const relief = await createReliefDecoder();
//   const { positions, normals, indices } = relief.decode(bytes);

const STATUS = ['OK', 'ARGUMENT', 'TRUNCATED', 'MAGIC', 'VERSION', 'CORRUPT', 'LIMIT', 'WORKSPACE', 'OUTPUT'];
// Sizes of the C structures, checked in exports.cpp, and a flag.
const LIMITS_BYTES = 24, OPTIONS_BYTES = 28, INFO_BYTES = 64, MESH_BYTES = 72, POINTS = 2;
const DEFAULT_LIMITS = { maxPatches: 2 ** 20, maxPixels: 2 ** 28, maxVertices: 2 ** 27, maxMemory: 0 };
const KEEP_BYTES = 64 << 20;  // WebAssembly memory never shrinks: an instance that grew beyond this is let go
const WORKER = 'relief-decoder';

// The module without vectors and behind it what makes the one with vectors of it, compressed (zlib, base64), and how large they
// are; bundle.mjs puts them in.
const PACKED = '', UNPACKED_BYTES = 0, PLAIN_BYTES = 0, SIMD_BYTES = 0;

// A function that splats an i32 and counts bits: valid where WebAssembly has vectors.
const SIMD_PROBE = Uint8Array.of(0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11);

// Undoes bundle.mjs' delta: in turns bytes of its own, in place of as many of `old`, and bytes of `old`, from a number further.
function patched(old, delta, size) {
  const out = new Uint8Array(size);
  let at = 0, from = 0, to = 0;
  const number = () => {
    let value = 0, scale = 1, byte;
    do {
      byte = delta[at++];
      value += (byte & 127) * scale;
      scale *= 128;
    } while (byte > 127);
    return value;
  };
  const copy = (bytes, begin, count) => {
    out.set(bytes.subarray(begin, begin + count), to);
    to += count;
    return begin + count;
  };
  for (;;) {
    const own = number();
    at = copy(delta, at, own);
    if (to === size) return out;
    const shift = number();
    from = copy(old, from + own + (shift & 1 ? -(shift + 1) / 2 : shift / 2), number());
  }
}

// The module that suits this machine. In loops, which start faster than what takes a function a byte, and read without a
// Response, for which Node would load its whole fetch.
async function moduleBytes() {
  const text = atob(PACKED), packed = new Uint8Array(text.length), bytes = new Uint8Array(UNPACKED_BYTES);
  for (let i = 0; i < packed.length; i++) packed[i] = text.charCodeAt(i);
  const reader = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate')).getReader();
  for (let at = 0, part; !(part = await reader.read()).done; at += part.value.length) bytes.set(part.value, at);
  const plain = bytes.subarray(0, PLAIN_BYTES);
  return WebAssembly.validate(SIMD_PROBE) ? patched(plain, bytes.subarray(PLAIN_BYTES), SIMD_BYTES) : plain;
}

export class ReliefError extends Error {
  constructor(code, message) {
    super(message);
    this.name = 'ReliefError';
    this.code = code;
  }
}

export async function createReliefDecoder({ workers = 0, module: given } = {}) {
  given ??= await moduleBytes();
  const module = given instanceof WebAssembly.Module ? given : await WebAssembly.compile(given);
  const state = { module, instance: await WebAssembly.instantiate(module) };
  const decodeHere = (stream, options) => guarded(state, wasm => decode(wasm, stream, options ?? {}));
  const pool = workers > 0 ? createPool(module, workers) : null;
  return {
    inspect: (stream, options) => guarded(state, wasm => inspect(wasm, place(wasm, stream, options ?? {}))),
    decode: decodeHere,
    decodeAsync: async (stream, options) => pool ? pool.decode(stream, options ?? {}) : decodeHere(stream, options),
    incremental: options => createIncremental(module, options ?? {}),
    dispose: () => pool?.close(),
  };
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
    if (state.keeps) ;
    else if (wasm.memory.buffer.byteLength > KEEP_BYTES) state.instance = null;
    else wasm.relief_wasm_reset();
  }
}

function allocate(wasm, bytes) {
  const address = bytes < 2 ** 32 ? wasm.relief_wasm_allocate(bytes) >>> 0 : 0;
  if (address === 0) throw new ReliefError('MEMORY', `not enough memory: the stream needs ${bytes} bytes more`);
  return address;
}

const isCount = (value, most = 2 ** 32 - 1) => Number.isInteger(value) && value >= 0 && value <= most;

function bytesGiven(stream) {
  const bytes = stream instanceof ArrayBuffer ? new Uint8Array(stream) : stream;
  if (!(bytes instanceof Uint8Array)) throw new ReliefError('ARGUMENT', 'the stream must be a Uint8Array or an ArrayBuffer');
  return bytes;
}

// Copies a stream and the options into the module.
function place(wasm, stream, { limits, level = 0, points = false, patches }) {
  const bytes = bytesGiven(stream);
  const { maxPatches, maxPixels, maxVertices, maxMemory } = { ...DEFAULT_LIMITS, ...limits };
  if (![maxPatches, maxPixels, maxVertices].every(v => isCount(v)) || !isCount(maxMemory, Number.MAX_SAFE_INTEGER)) {
    throw new ReliefError('ARGUMENT', 'limits must be whole numbers from 0 to 4294967295 (maxMemory: 9007199254740991)');
  }
  if (!isCount(level)) throw new ReliefError('ARGUMENT', 'the level must be a whole number');
  const data = allocate(wasm, Math.max(bytes.length, 1));
  const limitsAt = allocate(wasm, LIMITS_BYTES), options = allocate(wasm, OPTIONS_BYTES);
  const patchesAt = patches ? allocate(wasm, Math.max(patches.length, 1)) : 0;
  const memory = wasm.memory.buffer;
  new Uint8Array(memory).set(bytes, data);
  if (patches) new Uint8Array(memory, patchesAt, patches.length).set(Array.from(patches, wanted => (wanted ? 1 : 0)));
  new Uint32Array(memory, limitsAt, 6).set([maxPatches, maxPixels, maxVertices, 0, maxMemory % 2 ** 32, maxMemory / 2 ** 32]);
  new Uint32Array(memory, options, 7).set([limitsAt, patchesAt, level, points ? POINTS : 0, 0, 0, 0]);
  return { data, size: bytes.length, options };
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
  check(wasm, wasm.relief_inspect(input.data, input.size, input.options, at));
  const view = new DataView(wasm.memory.buffer, at, INFO_BYTES);
  const u32 = offset => view.getUint32(offset, true);
  const f32 = offset => view.getFloat32(offset, true);
  return {
    version: u32(0), patchCount: u32(4), pixelCount: u32(8), vertexCount: u32(12), triangleCount: u32(16),
    vertexCapacity: u32(20), triangleCapacity: u32(24), workspaceBytes: u32(32) + 2 ** 32 * u32(36),
    origin: [f32(40), f32(44), f32(48)], scale: f32(52), masksEnd: u32(56), hasColors: u32(60) === 1,
  };
}

// Room for a mesh and the workspace.
function layOut(wasm, input, { normals = true, colors = true, patches }) {
  const info = inspect(wasm, input);
  if (patches && patches.length !== info.patchCount) {
    throw new ReliefError('ARGUMENT', `there are ${info.patchCount} patches, and ${patches.length} are told of`);
  }
  const positions = allocate(wasm, info.vertexCapacity * 12);
  const normalsAt = normals ? allocate(wasm, info.vertexCapacity * 12) : 0;
  const colorsAt = colors && info.hasColors ? allocate(wasm, info.vertexCapacity * 4) : 0;
  const indices = allocate(wasm, info.triangleCapacity * 12);
  const mesh = allocate(wasm, MESH_BYTES);
  const workspace = allocate(wasm, info.workspaceBytes);
  new Uint32Array(wasm.memory.buffer, mesh, 6).set([positions, normalsAt, colorsAt, indices, info.vertexCapacity, info.triangleCapacity]);
  return { info, positions, normals: normalsAt, colors: colorsAt, indices, mesh, workspace };
}

// Copies a mesh out of the module.
function takeMesh(wasm, { info, positions, normals, colors, indices, mesh }) {
  const memory = wasm.memory.buffer;
  const [vertexCount, triangleCount] = new Uint32Array(memory, mesh + 24, 2);
  if (vertexCount > info.vertexCapacity || triangleCount > info.triangleCapacity) {
    throw new ReliefError('INTERNAL', 'the decoder wrote more than it announced');
  }
  return {
    positions: new Float32Array(memory, positions, 3 * vertexCount).slice(),
    normals: normals ? new Float32Array(memory, normals, 3 * vertexCount).slice() : null,
    colors: colors ? new Uint8Array(memory, colors, 4 * vertexCount).slice() : null,
    indices: new Uint32Array(memory, indices, 3 * triangleCount).slice(),
    vertexCount,
    triangleCount,
    min: [...new Float32Array(memory, mesh + 32, 3)],
    max: [...new Float32Array(memory, mesh + 44, 3)],
  };
}

function decode(wasm, stream, options) {
  const input = place(wasm, stream, options), at = layOut(wasm, input, options);
  check(wasm, wasm.relief_decode(input.data, input.size, input.options, at.mesh, at.workspace, at.info.workspaceBytes));
  return takeMesh(wasm, at);
}

// A stream that comes in pieces. It has an instance of its own, in which all stays between the calls: the workspace, the
// arrays and, at the end, where they can grow, the bytes.
function createIncremental(module, options) {
  const state = { module, instance: null, keeps: true };
  let early = new Uint8Array(0), at = null, failed = null;

  function begin(wasm, bytes) {
    const joined = new Uint8Array(early.length + bytes.length);
    joined.set(early);
    joined.set(bytes, early.length);
    early = joined;
    wasm.relief_wasm_reset();
    const input = place(wasm, early, options);
    at = { ...layOut(wasm, input, options), options: input.options, taken: allocate(wasm, 4), size: 0, room: 0 };
    new Uint32Array(wasm.memory.buffer, at.taken, 1)[0] = 0;
    append(wasm, early);
  }

  // What is allocated last lies behind what was before.
  function append(wasm, bytes) {
    const more = at.size + bytes.length - at.room;
    if (more > 0) {
      const grown = Math.ceil(Math.max(more, at.room, 16) / 16) * 16, address = allocate(wasm, grown);
      at.data ??= address;
      at.room += grown;
    }
    new Uint8Array(wasm.memory.buffer).set(bytes, at.data + at.size);
    at.size += bytes.length;
  }

  function push(wasm, bytes, wanted) {
    try {
      if (at) append(wasm, bytes);
      else begin(wasm, bytes);
    } catch (error) {
      if (error.code === 'TRUNCATED') return null;
      throw error;
    }
    check(wasm, wasm.relief_decode_more(at.data, at.size, at.options, wanted ? at.mesh : 0, at.workspace, at.info.workspaceBytes, at.taken));
    const mesh = wanted && takeMesh(wasm, at);
    return mesh && mesh.vertexCount > 0 ? mesh : null;
  }

  return {
    push(stream, { mesh = true } = {}) {
      if (failed) throw failed;
      const bytes = bytesGiven(stream);
      try {
        return guarded(state, wasm => push(wasm, bytes, mesh));
      } catch (error) {
        state.instance = null;  // its memory goes
        throw failed = error;
      }
    },
  };
}

// --- workers: this file again, in threads of their own ---

const listen = (target, kind, call) => (target.on ? target.on(kind, call) : target.addEventListener(kind, event => call(event.data ?? event)));

// The worker's side: first the module comes, then streams.
export function serveReliefWorker(port) {
  let state = null;
  listen(port, 'message', ({ module, stream, options }) => {
    if (module) {
      state = { module, instance: null };
      return;
    }
    try {
      const mesh = guarded(state, wasm => decode(wasm, stream, options));
      port.postMessage({ mesh }, [mesh.positions, mesh.normals, mesh.colors, mesh.indices].filter(Boolean).map(array => array.buffer));
    } catch ({ code = 'INTERNAL', message }) {
      port.postMessage({ code, message });
    }
  });
}

if (globalThis.WorkerGlobalScope && globalThis.name === WORKER) serveReliefWorker(globalThis);

async function newWorker() {
  if (globalThis.Worker) return new Worker(new URL('./relief.mjs', import.meta.url), { type: 'module', name: WORKER });
  const { Worker: Thread } = await import(/* @vite-ignore */ ['node', 'worker_threads'].join(':'));  // no bundler looks for it
  const serve = `import(${JSON.stringify(import.meta.url)}).then(relief => relief.serveReliefWorker(require('node:worker_threads').parentPort))`;
  return new Thread(serve, { eval: true });
}

// A worker with a function that asks it one thing at a time; it rejects with a ReliefError, or, if there is no worker any
// more, with another Error.
async function startWorker(module) {
  const worker = await newWorker();
  let waiting = null;
  const fail = error => waiting?.reject(new Error(error.message ?? 'the worker ended'));
  listen(worker, 'error', fail);
  listen(worker, 'exit', fail);
  listen(worker, 'message', ({ mesh, code, message }) => (mesh ? waiting.resolve(mesh) : waiting.reject(new ReliefError(code, message))));
  worker.postMessage({ module });
  worker.unref?.();  // while there is nothing to do, Node may end
  const ask = (message, transfer) => new Promise((resolve, reject) => {
    waiting = { resolve, reject };
    worker.ref?.();
    worker.postMessage(message, transfer);
  }).finally(() => {
    waiting = null;
    worker.unref?.();
  });
  return { ask, end: () => { fail(new Error('the decoder was disposed of')); worker.terminate(); } };
}

function createPool(module, most) {
  const queue = [], idle = [], all = new Set();
  let started = 0, closed = false;

  async function next() {
    if (queue.length === 0 || (idle.length === 0 && started >= most)) return;
    const { stream, options, resolve, reject } = queue.shift();
    let worker = idle.pop();
    try {
      if (!worker) {
        started++;
        worker = await startWorker(module);
        if (closed) worker.end();
        all.add(worker);
      }
      resolve(await worker.ask({ stream, options }, [stream.buffer]));
      idle.push(worker);
    } catch (error) {
      if (error instanceof ReliefError) {
        idle.push(worker);
      } else {  // the next stream gets a new one
        started--;
        all.delete(worker);
        worker?.end();
      }
      reject(error instanceof ReliefError ? error : new ReliefError('INTERNAL', `a worker failed: ${error.message}`));
    }
    next();
  }

  return {
    decode(stream, options) {
      if (closed) throw new ReliefError('ARGUMENT', 'the decoder was disposed of');
      const copy = new Uint8Array(bytesGiven(stream));  // goes to the worker
      return new Promise((resolve, reject) => {
        queue.push({ stream: copy, options, resolve, reject });
        next();
      });
    },
    close() {
      closed = true;
      for (const { reject } of queue.splice(0)) reject(new ReliefError('ARGUMENT', 'the decoder was disposed of'));
      for (const worker of all) worker.end();
    },
  };
}
