// Babylon.js: lets its glTF loader read primitives with RELIEF_patch_compression.
//
//   registerRelief(await createReliefDecoder());
//   await LoadAssetContainerAsync('statue.glb', scene);
import { VertexBuffer } from '@babylonjs/core/Buffers/buffer.js';
import { Geometry } from '@babylonjs/core/Meshes/geometry.js';
import { GLTFLoader } from '@babylonjs/loaders/glTF/2.0/glTFLoader.js';
import { registerGLTFExtension, unregisterGLTFExtension } from '@babylonjs/loaders/glTF/2.0/glTFLoaderExtensionRegistry.js';

import { linearColors } from './linear.mjs';

export const RELIEF_PATCH_COMPRESSION = 'RELIEF_patch_compression';

/** For all files from now on. decoder: what createReliefDecoder resolves to. */
export function registerRelief(decoder) {
  unregisterGLTFExtension(RELIEF_PATCH_COMPRESSION);
  registerGLTFExtension(RELIEF_PATCH_COMPRESSION, true, loader => new ReliefPatchCompression(loader, decoder));
}

class ReliefPatchCompression {
  constructor(loader, decoder) {
    this.name = RELIEF_PATCH_COMPRESSION;
    this.loader = loader;
    this.decoder = decoder;
    this.enabled = loader.isExtensionUsed(RELIEF_PATCH_COMPRESSION);
    this.geometries = new Map();  // of streams: of a buffer view for triangles or points
  }

  dispose() {
    this.loader = null;
  }

  // The loader's hook for the vertices and indices of a primitive; the rest takes its usual way.
  _loadVertexDataAsync(context, primitive, mesh) {
    return GLTFLoader.LoadExtensionAsync(context, primitive, this.name, async (extensionContext, { bufferView }) => {
      const points = primitive.mode === 0;
      if (points) mesh.isUnIndexed = true;
      const key = `${bufferView} ${points}`;
      if (!this.geometries.has(key)) this.geometries.set(key, this.load(extensionContext, bufferView, primitive, mesh));
      return this.geometries.get(key);
    });
  }

  async load(context, bufferView, primitive, { name }) {
    const view = this.loader.gltf.bufferViews?.[bufferView];
    if (!view) throw new Error(`${context}: there is no buffer view ${bufferView}`);
    const data = await this.loader.loadBufferViewAsync(`/bufferViews/${view.index}`, view);
    const stream = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
    const { NORMAL, COLOR_0 } = primitive.attributes;
    const options = { normals: NORMAL !== undefined, colors: COLOR_0 !== undefined };
    const decoded = await this.decoder.decodeAsync(stream, options).catch(error => {
      throw new Error(`${context}: ${error.message}`, { cause: error });
    });
    this.check(context, primitive, decoded);
    const geometry = new Geometry(name, this.loader.babylonScene);
    geometry.setVerticesData(VertexBuffer.PositionKind, decoded.positions);
    if (decoded.normals) geometry.setVerticesData(VertexBuffer.NormalKind, decoded.normals);
    if (decoded.colors) {
      geometry.setVerticesData(VertexBuffer.ColorKind, Float32Array.from(linearColors(decoded.colors), c => c / 65535), false, 4);
    }
    if (primitive.mode !== 0) geometry.setIndices(decoded.indices, decoded.vertexCount);
    return geometry;
  }

  // A loader must refuse a stream that decodes to other counts than its accessors have.
  check(context, { attributes, indices, mode }, decoded) {
    const expect = (name, index, count) => {
      const accessor = this.loader.gltf.accessors?.[index];
      if (!accessor) throw new Error(`${context}: ${RELIEF_PATCH_COMPRESSION} needs ${name}`);
      if (accessor.count !== count) {
        throw new Error(`${context}: ${name}: the accessor counts ${accessor.count} elements, the stream has ${count}`);
      }
    };
    for (const [name, index] of Object.entries(attributes)) expect(name, index, decoded.vertexCount);
    if (attributes.COLOR_0 !== undefined && !decoded.colors) throw new Error(`${context}: COLOR_0: the stream holds no colours`);
    if (mode !== 0) expect('indices', indices, 3 * decoded.triangleCount);
  }
}
