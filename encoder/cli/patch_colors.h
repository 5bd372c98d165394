// Pictures of a mesh: a colour a vertex.
#pragma once
#include <string>

#include "relief/encoder.h"

namespace relief::cli {

// Writes the mesh with a colour a patch; triangles of no patch are white.
void write_patch_colors(const std::string& out, const TriangleMesh& mesh, const std::vector<int>& labels);

// Writes the mesh with colours from blue (distance 0) over green to red (`red` and more).
void write_heatmap(const std::string& out, const TriangleMesh& mesh, const std::vector<float>& distances,
                   double red);

}  // namespace relief::cli
