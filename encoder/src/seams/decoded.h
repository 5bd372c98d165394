// What a stream decodes to, with the decoder's work between the patches, and where it comes from.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "code/stream.h"
#include "gaps.h"
#include "relief/encoder.h"

namespace relief {

struct DecodedMesh {
  TriangleMesh mesh;                     // model units
  std::vector<uint32_t> first_triangle;  // of each face between patches; those before it are the patches'
  std::vector<std::array<uint32_t, 2>> links;  // nodes that the decoder took for partners
  std::vector<LinkKind> kind;                  // what became of each
  std::vector<uint32_t> nodes;                 // the vertex of each

  size_t patch_triangles() const {
    return first_triangle.empty() ? mesh.triangles.size() : first_triangle[0];
  }
  size_t face_end(size_t face) const {
    return face + 1 < first_triangle.size() ? first_triangle[face + 1] : mesh.triangles.size();
  }
};

// Throws std::logic_error if the decoder refuses the encoder's own stream.
DecodedMesh decode_with_seams(const std::vector<uint8_t>& stream);

// A pixel of a mask. The decoder numbers the pixels of all masks in order: its first vertices.
struct Pixel {
  uint32_t patch, index;
};
std::vector<Pixel> pixels_of(const std::vector<CodedPatch>& patches);

// Numbers the parts that the triangles [0, count) connect; vertices in none of them get -1.
std::vector<int> connected_parts(const TriangleMesh& mesh, size_t count, int& parts);

}  // namespace relief
