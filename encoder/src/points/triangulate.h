// Triangles over points that lie on a surface, from Delaunay triangulations in their tangent planes: Gopi,
// Krishnan and Silva, "Surface Reconstruction Based on Lower Dimensional Localized Delaunay Triangulation",
// 2000.
#pragma once
#include "points/cloud.h"

namespace relief {

// The triangles that the stars of their corners agree on, then those that fit in between, then holes of at
// most 12 edges, or 24 where they are of very different length. No star has a triangle whose circumcircle is
// larger than the spacing warrants, so that rims stay rims and larger holes stay open. Every edge has at most
// two triangles, which agree in orientation; the outside is where the normals point.
std::vector<std::array<uint32_t, 3>> triangulate(const Cloud& cloud, const KdTree& tree);

}  // namespace relief
