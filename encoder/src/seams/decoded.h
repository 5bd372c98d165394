// What a stream decodes to, with the decoder's work between the patches, and where it comes from.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "code/stream.h"
#include "decode.h"
#include "relief/encoder.h"
#include "seams/meshed_patches.h"

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

// The patches of a stream, decoded once; the gaps between them can be closed with many seams. Throws
// std::logic_error if the decoder refuses the encoder's own stream.
class PatchDecoder {
 public:
  explicit PatchDecoder(const std::vector<uint8_t>& stream);
  // Of what these patches, meshed each alone, would be decoded to. open() has no masks then.
  PatchDecoder(const std::vector<const MeshedPatch*>& patches, const StreamPlacement& placement);
  // spare: what this function returned before, without tubes, to be written over: its patches are the same.
  DecodedMesh close(const Seams& seams, DecodedMesh spare = {});
  DecodedMesh close(const uint8_t* seams, const uint8_t* end, DecodedMesh spare = {});  // as in a stream
  const Parsed& parsed() const { return open_.parsed; }
  const OpenPatches& open() const { return open_; }
  const TriangleMesh& mesh() const { return mesh_; }  // with room beyond its vertices and triangles

 private:
  struct alignas(16) Block {
    uint8_t bytes[16];
  };
  void start_trace();

  std::unique_ptr<Block[]> workspace_;
  TriangleMesh mesh_;  // lattice coordinates; room for what closing adds
  OpenPatches open_;
  bool partners_known_ = false;
  // what a trace may fill
  std::vector<uint32_t> first_triangle_, nodes_;
  std::vector<std::array<uint32_t, 2>> links_;
  std::vector<LinkKind> kind_;
};

// With the stream's own seams.
DecodedMesh decode_with_seams(const std::vector<uint8_t>& stream);

// A pixel of a mask. The decoder numbers the pixels of all masks in order: its first vertices.
struct Pixel {
  uint32_t patch, index;
};
std::vector<Pixel> pixels_of(const std::vector<CodedPatch>& patches);

// Numbers the parts that the triangles [0, count) connect; vertices in none of them get -1.
std::vector<int> connected_parts(const TriangleMesh& mesh, size_t count, int& parts);

// What becomes of them, `part` and `parts` of the patches' triangles, with those between the patches: returns
// how many there are then, and in `joined` (may be null) the number for each of the patches' vertices.
int join_across_gaps(const DecodedMesh& decoded, const std::vector<int>& part, int parts,
                     std::vector<int>* joined);

}  // namespace relief
