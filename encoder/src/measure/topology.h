// Counts that say whether a mesh is closed, manifold and oriented.
#pragma once
#include <cmath>
#include <cstdint>

#include "relief/encoder.h"

namespace relief {

// Neighbours are flipped if their normals are more than 150 degrees apart.
inline const double kFlippedCosine = std::cos(150 * M_PI / 180);

struct Topology {
  uint64_t vertices = 0, triangles = 0;  // vertices used by a triangle
  uint64_t components = 0;               // connected by shared edges
  uint64_t open_edges = 0;               // edges of one triangle
  uint64_t nonmanifold_edges = 0;        // edges of three or more triangles, or of two that run the same way
  uint64_t nonmanifold_vertices = 0;     // vertices whose triangles form more than one fan
  uint64_t boundary_loops = 0;           // closed chains of open edges
  int64_t euler = 0;                     // V - E + F
  int64_t genus = 0;                     // sum over components of (2 - chi - loops) / 2; -1 if not manifold
  uint64_t flipped = 0;                  // pairs of neighbours, see kFlippedCosine
};

// by_position: vertices of equal position are one vertex (for files that split vertices by normal)
Topology topology(const TriangleMesh& mesh, bool by_position = false);

}  // namespace relief
