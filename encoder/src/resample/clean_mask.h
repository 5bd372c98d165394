// Making masks fit for meshing, and cheap to code.
#pragma once
#include "resample/elevation_map.h"

namespace relief {

// Smooths a mask's border: each pixel takes the value that most of the 3 by 3 around it have, but along the
// surface's own border, which stays where it is. New pixels have the elevation of the raster.
void smooth_border(ElevationMap& map, const FineRaster& fine);

// Makes a mask fit for meshing: fills holes of at most 12 pixels, drops islands of fewer than 4, pixels in no
// triangle and pixels where the border touches itself. New pixels get the elevation of the raster. Updates
// map.pixels.
void clean_mask(ElevationMap& map, const FineRaster& fine);

// Drops islands of fewer than 8 pixels beside larger ones: alone they would close to specks.
void drop_islands(ElevationMap& map);

// Drops pixels in no triangle and pixels where the border touches itself, until there are none.
void drop_unmeshable(ElevationMap& map);

}  // namespace relief
