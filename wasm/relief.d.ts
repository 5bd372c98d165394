/** Upper bounds on what a stream may ask for, checked before anything is sized by it. */
export interface ReliefLimits {
  /** Patches; default 2^20. */
  maxPatches?: number;
  /** Pixels of all patch rectangles together; default 2^28. */
  maxPixels?: number;
  /** Vertices of the mesh; default 2^27. */
  maxVertices?: number;
}

/** What a stream holds. */
export interface ReliefInfo {
  version: number;
  patchCount: number;
  pixelCount: number;
  /** Exact for a whole stream. */
  vertexCount: number;
  /** Exact for a whole stream. */
  triangleCount: number;
  /** No prefix of the stream decodes to more vertices. */
  vertexCapacity: number;
  /** No prefix of the stream decodes to more triangles. */
  triangleCapacity: number;
  workspaceBytes: number;
  origin: [number, number, number];
  scale: number;
  /** Length of the shortest prefix that decodes. */
  masksEnd: number;
}

export interface ReliefMesh {
  /** 3 a vertex. */
  positions: Float32Array;
  /** 3 a vertex, unit length; null if not asked for. */
  normals: Float32Array | null;
  /** 3 a triangle, counter-clockwise seen from outside. */
  indices: Uint32Array;
  vertexCount: number;
  triangleCount: number;
}

export interface ReliefDecodeOptions {
  /** Also compute normals; default true. */
  normals?: boolean;
  limits?: ReliefLimits;
}

export type ReliefErrorCode =
  | 'ARGUMENT' | 'TRUNCATED' | 'MAGIC' | 'VERSION' | 'CORRUPT' | 'LIMIT' | 'WORKSPACE' | 'OUTPUT'
  /** The memory of the WebAssembly module could not grow as far as the stream needs. */
  | 'MEMORY'
  /** The module stopped or answered nonsense: a bug in the decoder. */
  | 'INTERNAL';

export class ReliefError extends Error {
  readonly code: ReliefErrorCode;
}

export interface ReliefDecoder {
  /** Reads the header of a stream. Throws ReliefError. */
  inspect(stream: Uint8Array | ArrayBuffer, limits?: ReliefLimits): ReliefInfo;
  /**
   * Decodes a stream, or a prefix of one. The arrays belong to the caller. Throws ReliefError. Whatever the limits are, a
   * stream that asks for more than 1 GiB and 64 KiB for each of its bytes is over the LIMIT.
   */
  decode(stream: Uint8Array | ArrayBuffer, options?: ReliefDecodeOptions): ReliefMesh;
}

/**
 * Makes a decoder.
 * @param source relief.wasm or relief-simd.wasm as bytes, as a compiled module, or as an address to fetch; by default the
 * file beside this module: relief-simd.wasm where WebAssembly has vectors, else relief.wasm. Both give the same bytes.
 */
export function createReliefDecoder(
  source?: string | URL | ArrayBuffer | Uint8Array | WebAssembly.Module,
): Promise<ReliefDecoder>;
