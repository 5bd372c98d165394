// Telling real holes of an open surface from gaps between patches, by decoding.
#pragma once
#include <cstdint>
#include <vector>

#include "resample/cliffs.h"
#include "surface/surface.h"

namespace relief {

// What a stream decodes to, in lattice coordinates, with the faces between the patches.
struct DecodedMesh {
  std::vector<std::array<float, 3>> positions;       // model units
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<uint32_t> first_triangle;              // of each face between patches
  std::vector<std::array<uint32_t, 2>> links;        // vertices that the decoder took for partners
};

// Throws std::logic_error if the decoder refuses the encoder's own stream.
DecodedMesh decode_with_faces(const std::vector<uint8_t>& stream);

// Faces whose triangles leave the surface by more than `tolerance` lattice units: nothing is there in the original.
std::vector<uint32_t> find_holes(const DecodedMesh& mesh, const Surface& surface, const DistanceToSurface& distance,
                                 double tolerance);

}  // namespace relief
