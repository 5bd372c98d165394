// Holes of the surface that lie between the samples.
#pragma once
#include "resample/elevation_map.h"
#include "surface/border.h"

namespace relief {

// Takes a pixel out of the mask for each loop of the surface's border that is too small to show in it.
void punch_holes(ElevationMap& map, const Frame& frame, const std::vector<SurfaceBorder::Loop>& loops);

}  // namespace relief
