import type { GLTFLoaderPlugin, GLTFParser } from 'three/addons/loaders/GLTFLoader.js';
import type { ReliefDecoder } from 'relief-gltf';

export const RELIEF_PATCH_COMPRESSION: 'RELIEF_patch_compression';

/**
 * Colours of a decoded mesh (sRGB bytes, four a vertex) as glTF and three.js want them: linear, for a normalized
 * BufferAttribute of four 16-bit numbers.
 */
export function linearColors(colors: Uint8Array): Uint16Array;

/** What has been decoded so far for one file. */
export interface ReliefStats {
  streams: number;
  bytes: number;
  vertices: number;
  triangles: number;
  milliseconds: number;
}

/** GLTFLoader plugin: `loader.register(parser => new ReliefPatchCompression(parser, decoder))`. */
export class ReliefPatchCompression implements GLTFLoaderPlugin {
  constructor(parser: GLTFParser, decoder: ReliefDecoder);
  readonly name: 'RELIEF_patch_compression';
  readonly stats: ReliefStats;
  beforeRoot(): Promise<void>;
  loadBufferView(index: number): Promise<ArrayBuffer> | null;
}
