#include "allocate/distortion.h"

#include <cmath>

#include "resample/cells.h"

namespace relief {

Distortion sampling_distortion(const ElevationMap& map, const FineRaster& fine) {
  Distortion d;
  const double fine_spacing = map.spacing / kOversampling, fine_area = fine_spacing * fine_spacing;
  const std::vector<Cell> cells = cells_of(map);
  const size_t w = map.width;
  double plane_area = 0;
  each_sample(map, fine, cells, [&](size_t i, const Shares& s, size_t j) {
    if (fine.owner[j] != 1) return;
    // slope of the surface at the fine point: the distance is the elevation error times its cosine
    auto slope = [&](size_t step, bool inside) {
      return inside && fine.owner[j + step] ? (fine.z[j + step] - fine.z[j]) / fine_spacing : 0.0;
    };
    const double gx = slope(1, j % fine.width + 1 < fine.width);
    const double gy = slope(fine.width, j + fine.width < fine.z.size());
    const double cosine = 1 / std::sqrt(1 + gx * gx + gy * gy), area = fine_area / cosine;
    if (!s.covered) {
      d.gap_area += area;
      return;
    }
    const double z = double(s.a) * map.z[i] + double(s.b) * map.z[i + 1] + double(s.c) * map.z[i + w] +
                     double(s.d) * map.z[i + w + 1];
    const double e = (z - fine.z[j]) * cosine;
    d.squared += e * e * area;
    d.area += area;
    plane_area += fine_area;
  });
  if (d.area > 0) d.facing = plane_area / d.area;
  return d;
}

}  // namespace relief
