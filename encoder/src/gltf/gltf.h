// glTF in and out with the extension RELIEF_patch_compression.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "relief/encoder.h"

namespace relief {

// What was done with a primitive of the input.
struct PrimitiveReport {
  std::string name;  // "mesh 0 'statue' primitive 0"
  bool compressed = false;
  std::string reason;  // why not compressed, one line; empty if it was
  uint64_t vertices = 0, triangles = 0;
  uint64_t bytes_before = 0;  // of its vertices (positions, normals) and indices; 0 if not read
  uint64_t bytes_after = 0;   // of the stream
  EncodeResult result;        // stream empty if not compressed
};

// share: this primitive's vertices over those of all primitives that will be encoded, to share out a number
// of bytes.
using PrimitiveEncoder = std::function<EncodeResult(const TriangleMesh&, double share)>;

// Reads .glb/.gltf `in`, calls `encode_primitive` for every primitive of triangles or points that can be
// coded, and writes `out` (.glb or .gltf) with the rest of the scene unchanged. Geometry used twice is
// encoded once. Primitives with attributes other than POSITION and NORMAL, with morph targets, or that share
// border vertices with another primitive of the same mesh pass through, as do those that would grow and those
// that `encode_primitive` refuses with an InputError. Accessors, buffer views and bytes that nothing refers
// to any more are left out; if an extension that we do not know seems to refer to them by index, everything
// passes through.
std::vector<PrimitiveReport> compress_gltf(const std::string& in, const std::string& out,
                                           const PrimitiveEncoder& encode_primitive);

// Writes a scene of one node, one mesh, one primitive for a stream; points: it draws them, not triangles.
void write_stream_gltf(const std::string& out, const std::vector<uint8_t>& stream, bool points = false);

// Writes a plain scene of one primitive: triangles, or points if there are none.
void write_mesh_gltf(const std::string& out, const TriangleMesh& mesh);

// Reads `in`, replaces every compressed primitive by a plain one of triangles, or of points if so asked, and
// writes `out` (.glb or .gltf). Returns how many.
size_t decompress_gltf(const std::string& in, const std::string& out, const DecodeOptions& options = {});

// All streams of a file: of every primitive of a .glb/.gltf, or the file itself if it is a bare .relief
// stream.
std::vector<std::vector<uint8_t>> read_streams(const std::string& path);

}  // namespace relief
