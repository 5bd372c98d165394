// glTF in and out with the extension RELIEF_patch_compression.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "relief/encoder.h"

namespace relief {

// What was done with a primitive of the input.
struct PrimitiveReport {
  std::string name;       // "mesh 'statue' primitive 0"
  bool compressed = false;
  std::string reason;     // why not compressed, one line; empty if it was
  uint64_t vertices = 0, triangles = 0, bytes_before = 0, bytes_after = 0;
  EncodeResult result;    // stream empty if not compressed
};

using PrimitiveEncoder = std::function<EncodeResult(const TriangleMesh&)>;

// Reads .glb/.gltf `in`, calls `encode_primitive` for every triangle primitive that can be coded, and writes `out`
// (.glb or .gltf) with the rest of the scene unchanged. A mesh used twice is encoded once. Primitives with attributes
// other than POSITION and NORMAL, with morph targets, or that share border vertices with another primitive of the same
// mesh pass through, as do those that would grow.
std::vector<PrimitiveReport> compress_gltf(const std::string& in, const std::string& out,
                                           const PrimitiveEncoder& encode_primitive);

// Writes a scene of one node, one mesh, one primitive for a stream.
void write_stream_gltf(const std::string& out, const std::vector<uint8_t>& stream);

// Reads `in`, replaces every compressed primitive by a plain one, and writes `out` (.glb or .gltf).
void decompress_gltf(const std::string& in, const std::string& out);

// All streams of a file: of every primitive of a .glb/.gltf, or the file itself if it is a bare .relief stream.
std::vector<std::vector<uint8_t>> read_streams(const std::string& path);

}  // namespace relief
