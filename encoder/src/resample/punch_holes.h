// Holes of the surface that lie between the samples.
#pragma once
#include "resample/elevation_map.h"

namespace relief {

// Takes a pixel out of the mask for each of the patch's loops that is too small to show in it.
void punch_holes(ElevationMap& map, const PatchFaces& patch);

}  // namespace relief
