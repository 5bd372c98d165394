// Boundary smoothing (5.3).
#pragma once
#include "mesh.h"
#include "nodes.h"

namespace relief {

// Moves the nodes a third of the way to the mean of their neighbours in the mesh, all at once. Half of the
// way gives little smoother normals, but costs three times as much of the error on Dragon.
//   node_of   scratch, vertices of all patches
//   sums      scratch, of each node: the sum of its neighbours' coordinates and their number
void smooth_nodes(const Nodes& nodes, uint32_t patch_vertices, MeshWriter& mesh, uint32_t* node_of,
                  int64_t (*sums)[4]);

}  // namespace relief
