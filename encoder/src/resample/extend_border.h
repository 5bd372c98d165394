// Masks that reach to where the surface ends.
#pragma once
#include "resample/elevation_map.h"

namespace relief {

// Adds pixels that lie beside the surface, but within half a spacing of its border: of the pixels on the
// surface alone the last lie half a spacing inside of the border, on average, so that a strip along it would
// be lost. A new pixel has the elevation of the nearest point of the raster and the face of a pixel beside
// it. from_border: of each face, its distance to the surface's border; empty: the surface has none.
void extend_border(ElevationMap& map, const FineRaster& fine, const std::vector<float>& from_border);

}  // namespace relief
