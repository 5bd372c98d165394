// three.js: lets GLTFLoader read primitives with RELIEF_patch_compression.
//
//   const decoder = await createReliefDecoder();
//   loader.register(parser => new ReliefPatchCompression(parser, decoder));
//
// GLTFLoader has a hook for buffer views but none for primitives. So before anything is loaded the accessors of each
// compressed primitive are pointed at buffer views made up here, one for positions, normals, colours and indices, and a
// stream is decoded when the first of its views is asked for. Everything else of the scene (materials, names, several
// primitives, instances, animation) takes GLTFLoader's usual way.

import { linearColors } from './linear.mjs';

export { linearColors };
export const RELIEF_PATCH_COMPRESSION = 'RELIEF_patch_compression';

const FLOAT = 5126, UNSIGNED_SHORT = 5123;
const INDEX_ARRAYS = { 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array };

export class ReliefPatchCompression {
  /**
   * @param parser  what GLTFLoader.register hands over
   * @param decoder what createReliefDecoder resolves to
   */
  constructor(parser, decoder) {
    this.name = RELIEF_PATCH_COMPRESSION;
    this.parser = parser;
    this.decoder = decoder;
    this.views = new Map();  // index of a made-up buffer view -> function that resolves to its ArrayBuffer
    this.stats = { streams: 0, bytes: 0, vertices: 0, triangles: 0, milliseconds: 0 };
  }

  // GLTFLoader hook: called before the first dependency is loaded.
  async beforeRoot() {
    const { meshes = [] } = this.parser.json;
    for (const [m, mesh] of meshes.entries()) {
      for (const [p, primitive] of mesh.primitives.entries()) {
        const extension = primitive.extensions?.[RELIEF_PATCH_COMPRESSION];
        if (extension) this.redirect(primitive, extension, `mesh ${m} primitive ${p}`);
      }
    }
  }

  // GLTFLoader hook: null leaves the view to the next plugin and then to GLTFLoader.
  loadBufferView(index) {
    return this.views.get(index)?.() ?? null;
  }

  // Points the accessors of a compressed primitive at made-up buffer views.
  redirect(primitive, extension, where) {
    const json = this.parser.json;
    const { POSITION, NORMAL, COLOR_0 } = primitive.attributes;
    let decoded = null;
    const mesh = () => (decoded ??= this.decode(extension.bufferView, { normals: NORMAL !== undefined, colors: COLOR_0 !== undefined }));
    const redirectAccessor = (index, name, contents) => {
      const accessor = json.accessors?.[index];
      if (!accessor) throw new Error(`THREE.GLTFLoader: ${where}: ${RELIEF_PATCH_COMPRESSION} needs ${name}`);
      if (this.views.has(accessor.bufferView)) return;  // shared with a primitive of the same stream
      accessor.bufferView = json.bufferViews.push({ buffer: 0, byteLength: 0 }) - 1;
      accessor.byteOffset = 0;
      this.views.set(accessor.bufferView, async () => contents(await mesh(), accessor, `${where}: ${name}`));
    };
    redirectAccessor(POSITION, 'POSITION', ({ positions }, accessor, what) => floats(positions, accessor, what));
    if (NORMAL !== undefined) {
      redirectAccessor(NORMAL, 'NORMAL', ({ normals }, accessor, what) => floats(normals, accessor, what));
    }
    if (COLOR_0 !== undefined) {
      redirectAccessor(COLOR_0, 'COLOR_0', ({ colors }, accessor, what) => linear(colors, accessor, what));
    }
    if (primitive.mode === 0) return;  // draws the vertices of the surface as points
    redirectAccessor(primitive.indices, 'indices', ({ indices }, accessor, what) => integers(indices, accessor, what));
  }

  async decode(bufferView, options) {
    const stream = new Uint8Array(await this.parser.getDependency('bufferView', bufferView));
    const begin = performance.now();
    const mesh = await this.decoder.decodeAsync(stream, options);
    this.stats.milliseconds += performance.now() - begin;
    this.stats.streams += 1;
    this.stats.bytes += stream.length;
    this.stats.vertices += mesh.vertexCount;
    this.stats.triangles += mesh.triangleCount;
    return mesh;
  }
}

function expectCount(got, accessor, what) {
  if (accessor.count !== got) {
    throw new Error(`THREE.GLTFLoader: ${what}: the accessor counts ${accessor.count} elements, the stream has ${got}`);
  }
}

function floats(array, accessor, what) {
  expectCount(array.length / 3, accessor, what);
  if (accessor.componentType !== FLOAT || accessor.type !== 'VEC3') {
    throw new Error(`THREE.GLTFLoader: ${what}: the accessor must be VEC3 of floats`);
  }
  return array.buffer;
}

function linear(colors, accessor, what) {
  if (!colors) throw new Error(`THREE.GLTFLoader: ${what}: the stream holds no colours`);
  expectCount(colors.length / 4, accessor, what);
  if (accessor.componentType !== UNSIGNED_SHORT || accessor.type !== 'VEC4' || !accessor.normalized) {
    throw new Error(`THREE.GLTFLoader: ${what}: the accessor must be VEC4 of normalized unsigned shorts`);
  }
  return linearColors(colors).buffer;
}

function integers(array, accessor, what) {
  expectCount(array.length, accessor, what);
  const Type = INDEX_ARRAYS[accessor.componentType];
  if (!Type || accessor.type !== 'SCALAR') {
    throw new Error(`THREE.GLTFLoader: ${what}: the accessor must be SCALAR of unsigned integers`);
  }
  return Type === Uint32Array ? array.buffer : Type.from(array).buffer;
}
