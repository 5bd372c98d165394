// What the encoder learns by decoding its own stream: which faces between patches are real holes of the
// surface, and which links between patches are wrong.
#pragma once
#include <cstdint>
#include <vector>

#include "code/stream.h"
#include "measure/topology.h"
#include "resample/cliffs.h"
#include "surface/surface.h"

namespace relief {

// What a stream decodes to, with the decoder's work between the patches.
struct DecodedMesh {
  TriangleMesh mesh;                           // model units
  std::vector<uint32_t> first_triangle;        // of each face between patches
  std::vector<std::array<uint32_t, 2>> links;  // vertices that the decoder took for partners
};

// Throws std::logic_error if the decoder refuses the encoder's own stream.
DecodedMesh decode_with_seams(const std::vector<uint8_t>& stream);

struct SeamsInput {
  const Surface& surface;
  Topology topology;  // of the surface
  DistanceToSurface distance;
  bool closed;
  double spacing;  // the coarsest grid's, lattice units
};

// Finds the seams with which `parts` decodes to the surface: its holes open, its gaps closed. thorough: also
// tries to reach the surface's topology by dropping links and opening or closing faces (a few dozen
// decodings). `decoded` receives what the stream with these seams decodes to.
Seams find_seams(const StreamParts& parts, const SeamsInput& input, bool thorough, DecodedMesh& decoded);

}  // namespace relief
