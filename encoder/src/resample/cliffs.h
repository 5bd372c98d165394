// Cells of a map that bridge a cliff: the surface there belongs to other patches or is hidden, and the map's
// triangles would run through empty space.
#pragma once
#include <functional>
#include <vector>

#include "resample/elevation_map.h"

namespace relief {

// Distances of points to the surface, lattice units.
using DistanceToSurface = std::function<std::vector<float>(const std::vector<Vec3>&)>;

// Cuts pixels out of the mask until no steep edge of a cell is farther than 0.7 spacings from the surface.
// Returns the number of pixels cut. The mask is clean again afterwards.
size_t cut_cliffs(ElevationMap& map, const Frame& frame, const DistanceToSurface& distance);

}  // namespace relief
