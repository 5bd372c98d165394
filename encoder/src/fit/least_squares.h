// Least-squares fitting of elevations (4.1): the canonical mesh approximates the surface instead of
// interpolating it.
#pragma once
#include "resample/elevation_map.h"

namespace relief {

// Adjusts map.z so that the sum of squared elevation errors over the fine raster's points is smallest. Points
// of other patches around count little; a weak pull to the sampled elevations keeps pixels that no point
// determines.
void fit_elevations(ElevationMap& map, const FineRaster& fine);

}  // namespace relief
