// Vertex normals: the sum of the normals of the triangles around, weighted by area, so that they run on over
// gaps.
#pragma once
#include "mesh.h"

namespace relief {

// Adds the normals of all triangles of the mesh to those of their vertices. mesh.positions are lattice
// coordinates; normals: 3 floats a vertex, zero to begin with, Leaves::normalise when all is added.
void add_normals(const MeshWriter& mesh, float* normals);

}  // namespace relief
