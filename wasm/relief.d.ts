/** Upper bounds on what a stream may ask for, checked before anything is sized by it. */
export interface ReliefLimits {
  /** Patches; default 2^20. */
  maxPatches?: number;
  /** Pixels of all patch rectangles together; default 2^28. */
  maxPixels?: number;
  /** Vertices of the mesh; default 2^27. */
  maxVertices?: number;
  /**
   * Bytes of memory that a decode may need, by a formula that is above what it does need; default (0): 1 GiB and 64 KiB for
   * each byte of the stream.
   */
  maxMemory?: number;
}

/** What a stream holds. */
export interface ReliefInfo {
  version: number;
  patchCount: number;
  pixelCount: number;
  /** Exact for a whole stream. */
  vertexCount: number;
  /** Exact for a whole stream at level 0. */
  triangleCount: number;
  /** No prefix of the stream decodes to more vertices, with the options given. */
  vertexCapacity: number;
  /** No prefix of the stream decodes to more triangles, with the options given. */
  triangleCapacity: number;
  workspaceBytes: number;
  origin: [number, number, number];
  scale: number;
  /** Bytes of the header, the patch table and the masks: a shorter prefix has some of the patches only, or none. */
  masksEnd: number;
  /** Whether vertices have colours. */
  hasColors: boolean;
}

export interface ReliefMesh {
  /** 3 a vertex. */
  positions: Float32Array;
  /** 3 a vertex, unit length; null if not asked for. */
  normals: Float32Array | null;
  /** 4 a vertex: red, green, blue as sRGB (glTF and three.js want them linear), 255; null if there are none or none asked for. */
  colors: Uint8Array | null;
  /** 3 a triangle, counter-clockwise seen from outside; none of points. */
  indices: Uint32Array;
  vertexCount: number;
  triangleCount: number;
  /** Bounds of the positions; zeros if there are none. */
  min: [number, number, number];
  max: [number, number, number];
}

export interface ReliefOptions {
  limits?: ReliefLimits;
  /** A grid coarser by 2^level each way, 0 to 4; default 0. As good a manifold, closed where the surface is. */
  level?: number;
  /** Points instead of triangles: the vertices of the patches, gaps between them left open; default false. */
  points?: boolean;
}

export interface ReliefDecodeOptions extends ReliefOptions {
  /** Also compute normals; default true. */
  normals?: boolean;
  /** Also decode colours, if there are any; default true. They come last in a stream: in a prefix they may be grey. */
  colors?: boolean;
  /** For each patch (ReliefInfo.patchCount of them) whether to decode it; default all. */
  patches?: Uint8Array | readonly boolean[];
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
  inspect(stream: Uint8Array | ArrayBuffer, options?: ReliefOptions): ReliefInfo;
  /** Decodes a stream, or a prefix of one, in this thread. The arrays belong to the caller. Throws ReliefError. */
  decode(stream: Uint8Array | ArrayBuffer, options?: ReliefDecodeOptions): ReliefMesh;
  /**
   * The same in a worker, if the decoder has any, else in this thread. The stream is copied; as many are decoded at once as
   * there are workers, the others wait. Rejects with ReliefError; the next stream is decoded all the same.
   */
  decodeAsync(stream: Uint8Array | ArrayBuffer, options?: ReliefDecodeOptions): Promise<ReliefMesh>;
  /** A decoder for a stream that arrives in pieces. It has memory of its own, which goes with it. */
  incremental(options?: ReliefDecodeOptions): ReliefIncremental;
  /** Ends the workers. What they had not finished is rejected. */
  dispose(): void;
}

export interface ReliefIncremental {
  /**
   * Takes the next bytes of the stream in and returns what decode() makes of all so far, or null while that is nothing.
   * Behind the masks (ReliefInfo.masksEnd) earlier bytes are not decoded again; the mesh is made anew.
   * @param options mesh: false returns no mesh, to save the time for it
   * Throws ReliefError; from then on always the same.
   */
  push(bytes: Uint8Array | ArrayBuffer, options?: { mesh?: boolean }): ReliefMesh | null;
}

export interface ReliefDecoderOptions {
  /**
   * Threads for decodeAsync, started when they are first needed; default 0. In a browser they load this module again, so it
   * must come from the page's own origin.
   */
  workers?: number;
  /** Another build of the decoder; default: one of the two in this file, with vectors where WebAssembly has them. */
  module?: ArrayBuffer | Uint8Array | WebAssembly.Module;
}

/** Makes a decoder. Under a Content-Security-Policy it needs 'wasm-unsafe-eval', and for workers worker-src 'self'. */
export function createReliefDecoder(options?: ReliefDecoderOptions): Promise<ReliefDecoder>;
