// The image-based distortion of 3.6, equation (6), as squared distance times area.
#pragma once
#include "resample/elevation_map.h"

namespace relief {

struct Distortion {
  double squared = 0;   // integral of the squared distance over the covered part, lattice units^4
  double area = 0;      // of the covered part, lattice units^2
  double gap_area = 0;  // of the part that the patch owns but its cells do not cover, near them
  double bend = 0;      // integral of the squared distance between the gap and straight triangles over it
  double lost = 0;    // integral of the squared distance over what the patch owns farther away from its cells
  double facing = 1;  // mean cosine between surface and plane over the covered part
};

// What the canonical mesh of the map loses against the surface, with unquantised elevations.
Distortion sampling_distortion(const ElevationMap& map, const FineRaster& fine);

}  // namespace relief
