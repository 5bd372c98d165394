// The smallest cone around a set of normals (paper, 3.2).
#pragma once
#include <vector>

#include "surface/surface.h"

namespace relief {

struct EnclosingCone {
  Vec3 axis = Vec3::Zero();  // unit; zero if no open half-space holds all normals
  double cosine = 0;         // of the angle between the axis and the farthest normal; 0 without an axis
};

// Exact but for rounding: the ball is found in double precision. The normals are unit vectors; an empty set
// has no axis.
EnclosingCone smallest_enclosing_cone(const std::vector<Vec3>& normals);

}  // namespace relief
