// Tubes between triangles: handles of the surface that are smaller than the grid.
#pragma once
#include "mesh.h"

namespace relief {

// What a tube adds to a mesh.
constexpr uint32_t kTubeVertices = 6, kTubeTriangles = 16;

// Joins triangles x and y of a mesh in lattice coordinates. Two more of the tube's triangles take their
// places and end with a vertex of its own. False, with nothing added: no room.
bool add_tube(MeshWriter& mesh, uint32_t x, uint32_t y);

}  // namespace relief
