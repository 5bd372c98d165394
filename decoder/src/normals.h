// Vertex normals: the sum of the normals of the triangles around, weighted by area, so that they run on over
// gaps.
#pragma once
#include "leaves.h"
#include "mesh.h"

namespace relief {

// mesh.positions are lattice coordinates. normals: 3 floats a vertex; (0, 0, 1) where the triangles have no
// area.
void vertex_normals(const MeshWriter& mesh, float* normals, const Leaves& leaves);

}  // namespace relief
