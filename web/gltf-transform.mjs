// glTF-Transform: reads primitives with RELIEF_patch_compression. What is written is not compressed: encoding takes the native
// program, after everything else (relief encode in.glb out.glb).
//
//   const io = new NodeIO().registerExtensions([ReliefPatchCompression])
//     .registerDependencies({ 'relief.decoder': await createReliefDecoder() });
import { Extension, PropertyType } from '@gltf-transform/core';

import { linearColors } from './linear.mjs';

export const RELIEF_PATCH_COMPRESSION = 'RELIEF_patch_compression';
const GLB_BUFFER = '@glb.bin';  // glTF-Transform's name for a GLB's binary chunk

export class ReliefPatchCompression extends Extension {
  static EXTENSION_NAME = RELIEF_PATCH_COMPRESSION;
  extensionName = RELIEF_PATCH_COMPRESSION;
  prereadTypes = [PropertyType.PRIMITIVE];
  readDependencies = ['relief.decoder'];

  install(key, dependency) {
    if (key === 'relief.decoder') this.decoder = dependency;
    return this;
  }

  // Fills the accessors of compressed primitives before the primitives are made of them.
  preread(context) {
    if (!this.decoder) throw new Error(`${RELIEF_PATCH_COMPRESSION}: 'relief.decoder' is not registered (NodeIO.registerDependencies)`);
    const decoded = new Map();
    for (const [m, { primitives }] of (context.jsonDoc.json.meshes ?? []).entries()) {
      for (const [p, primitive] of primitives.entries()) {
        const extension = primitive.extensions?.[RELIEF_PATCH_COMPRESSION];
        if (!extension) continue;
        const { bufferView } = extension;
        if (!decoded.has(bufferView)) decoded.set(bufferView, this.decoder.decode(streamOf(context.jsonDoc, bufferView)));
        fill(context, primitive, decoded.get(bufferView), `mesh ${m} primitive ${p}`);
      }
    }
    return this;
  }

  // Nothing in the document is compressed any more.
  read() {
    this.dispose();
    return this;
  }

  write() {
    return this;
  }
}

function streamOf({ json, resources }, index) {
  const view = json.bufferViews?.[index], buffer = json.buffers?.[view?.buffer];
  if (!buffer) throw new Error(`${RELIEF_PATCH_COMPRESSION}: there is no buffer view ${index}`);
  const bytes = resources[buffer.uri ?? GLB_BUFFER];
  return bytes.subarray(view.byteOffset ?? 0, (view.byteOffset ?? 0) + view.byteLength);
}

const SIZES = { SCALAR: 1, VEC3: 3, VEC4: 4 };

function fill({ accessors, jsonDoc }, { attributes, indices, mode }, mesh, where) {
  const set = (name, index, array) => {
    const { count, type } = jsonDoc.json.accessors?.[index] ?? {};
    if (count === undefined) throw new Error(`${where}: ${RELIEF_PATCH_COMPRESSION} needs ${name}`);
    if (!array) throw new Error(`${where}: ${name}: the stream does not hold it`);
    if (count * SIZES[type] !== array.length) {
      throw new Error(`${where}: ${name}: the accessor counts ${count} elements of ${type}, the stream has ${array.length} numbers`);
    }
    accessors[index].setArray(array);
  };
  const arrays = { POSITION: mesh.positions, NORMAL: mesh.normals, COLOR_0: mesh.colors && linearColors(mesh.colors) };
  for (const [name, index] of Object.entries(attributes)) set(name, index, arrays[name]);
  if (mode !== 0) set('indices', indices, mesh.indices);
}
