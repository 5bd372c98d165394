// Which faces between patches are holes of the surface: those around which it has a border.
#pragma once
#include "seams/gap_error.h"
#include "surface/border.h"

namespace relief {

struct HoleFace {
  uint32_t face;   // between patches
  int loop;        // of the surface's border, that most of the nodes around the face are near
  double share;    // of the nodes that are
  float distance;  // from the surface, of what the face is filled with, in grid spacings
};

// Faces with a good part of their nodes near one loop, in ascending order.
std::vector<HoleFace> faces_along_border(const DecodedMesh& decoded, const Ground& ground,
                                         const SurfaceBorder& border, const GapError& error, double spacing);

}  // namespace relief
