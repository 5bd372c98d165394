import { Extension, type ReaderContext, type WriterContext } from '@gltf-transform/core';

export const RELIEF_PATCH_COMPRESSION: 'RELIEF_patch_compression';

/**
 * glTF-Transform extension, for reading: `io.registerExtensions([ReliefPatchCompression])` and
 * `io.registerDependencies({ 'relief.decoder': await createReliefDecoder() })`. Documents are not compressed afterwards.
 */
export class ReliefPatchCompression extends Extension {
  static readonly EXTENSION_NAME: 'RELIEF_patch_compression';
  readonly extensionName: 'RELIEF_patch_compression';
  read(context: ReaderContext): this;
  write(context: WriterContext): this;
}
