// Which colours the vertices of a decoded surface should have.
#pragma once
#include "relief/encoder.h"

namespace relief {

using Colour = std::array<uint8_t, 4>;

// One for each position: the mean of the input's vertices that lie nearest to it. Where there are none (the
// input is coarser there), of a mesh what it has at the closest point, of a cloud the mean of a few points
// around, weighted by distance.
std::vector<Colour> nearest_colours(const TriangleMesh& input,
                                    const std::vector<std::array<float, 3>>& positions);

}  // namespace relief
