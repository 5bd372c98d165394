// Which primitives share a border: compressed apart, a crack would open between them.
#pragma once
#include <vector>

#include "relief/encoder.h"

namespace relief {

// The positions on the border (edges of one triangle) of a mesh, equal positions being one vertex; sorted.
std::vector<std::array<float, 3>> border_positions(const TriangleMesh& mesh);

// Do two sorted lists have an item in common?
bool have_common(const std::vector<std::array<float, 3>>& a, const std::vector<std::array<float, 3>>& b);

}  // namespace relief
