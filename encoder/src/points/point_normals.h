// Normals of a point cloud: Hoppe et al., "Surface Reconstruction from Unorganized Points", 1992.
#pragma once
#include "points/cloud.h"

namespace relief {

// The normal of the plane through the points within `radius` of each one, or a little less where they are
// flatter there: the smallest axis of their weighted covariance, without a sign.
std::vector<Vec3> plane_normals(const KdTree& tree, const std::vector<double>& radius);

// The rms distance of the points within `radius` of point i from their plane, over the radius.
double plane_thickness(const KdTree& tree, size_t i, double radius);

// Turns normals so that neighbours agree: along the minimum spanning tree of the neighbourhood graph, whose
// edges weigh what the planes at their ends deviate. In each connected part, the normal at the highest point
// looks up. Returns the number of parts.
size_t orient_normals(const KdTree& tree, std::vector<Vec3>& normals);

}  // namespace relief
