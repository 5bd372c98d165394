// Errors of point clouds (paper, 3.1).
#pragma once
#include "relief/encoder.h"

namespace relief {

// Distances in the units of the clouds; a is the original. A side that is not measured is 0.
struct PointError {
  double rms_ab = 0, max_ab = 0;  // from the points of a to b
  double rms_ba = 0, max_ba = 0;
  double diagonal = 0;  // of a's bounding box, over all of its positions
};

// One of a and b, or both, is a point cloud. From points to a mesh, one way, the distance to the nearest
// triangle. Where both are points, both ways, what projecting onto the MLS surface of the other moves them
// by. Throws InputError if a has no extent, or if a surface is needed and there is none.
PointError point_error(const TriangleMesh& a, const TriangleMesh& b);

}  // namespace relief
