import type { ReliefDecoder } from 'relief-gltf';

export const RELIEF_PATCH_COMPRESSION: 'RELIEF_patch_compression';

/** Babylon.js reads primitives with RELIEF_patch_compression in all glTF files that are loaded from now on. */
export function registerRelief(decoder: ReliefDecoder): void;
