#include "allocate/distortion.h"

#include <algorithm>
#include <cmath>

#include "resample/cells.h"

namespace relief {
namespace {

// Distance of every pixel to the nearest one of a covered cell, in pixels (two-pass chamfer, 5-7-11 rounded
// down to 1 and 1.4).
std::vector<float> distance_to_cells(const ElevationMap& map, const std::vector<Cell>& cells) {
  const int w = int(map.width), h = int(map.height);
  std::vector<float> d(map.mask.size(), 1e6f);
  for (int y = 0; y + 1 < h; y++)
    for (int x = 0; x + 1 < w; x++) {
      const size_t i = size_t(y) * size_t(w) + size_t(x);
      if (cells[i] == Cell::kNone) continue;
      for (size_t j : {i, i + 1, i + size_t(w), i + size_t(w) + 1})
        if (map.mask[j]) d[j] = 0;
    }
  auto relax = [&](int x, int y, int dx, int dy) {
    if (x + dx < 0 || x + dx >= w || y + dy < 0 || y + dy >= h) return;
    float& here = d[size_t(y) * size_t(w) + size_t(x)];
    here = std::min(here, d[size_t(y + dy) * size_t(w) + size_t(x + dx)] + (dx && dy ? 1.4f : 1.0f));
  };
  for (int y = 0; y < h; y++)
    for (int x = 0; x < w; x++)
      for (auto [dx, dy] : {std::pair{-1, 0}, {-1, -1}, {0, -1}, {1, -1}}) relax(x, y, dx, dy);
  for (int y = h; y-- > 0;)
    for (int x = w; x-- > 0;)
      for (auto [dx, dy] : {std::pair{1, 0}, {1, 1}, {0, 1}, {-1, 1}}) relax(x, y, dx, dy);
  return d;
}

// How far the surface bends away from a straight line over a point of a gap: half the second difference over
// a pixel each way. Where the surface ends or turns out of sight, half a pixel.
double bend_at(const FineRaster& fine, size_t j, double spacing) {
  const size_t x = j % fine.width, y = j / fine.width;
  auto along = [&](size_t position, size_t size, size_t step) {
    if (position < kOversampling || position + kOversampling >= size) return spacing / 2;
    const size_t a = j - kOversampling * step, b = j + kOversampling * step;
    if (!fine.owner[a] || !fine.owner[b]) return spacing / 2;
    return std::min(spacing / 2, double(std::fabs(fine.z[j] - (fine.z[a] + fine.z[b]) / 2)));
  };
  return std::max(along(x, fine.width, 1), along(y, fine.height, fine.width));
}

}  // namespace

Distortion sampling_distortion(const ElevationMap& map, const FineRaster& fine) {
  Distortion d;
  const double fine_spacing = map.spacing / kOversampling, fine_area = fine_spacing * fine_spacing;
  const std::vector<Cell> cells = cells_of(map);
  const std::vector<float> away = distance_to_cells(map, cells);
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
      const float far = (away[i] - 1.5f) * float(map.spacing);
      if (far > 0) {
        d.lost += double(far) * far * area;
      } else {
        const double bend = bend_at(fine, j, map.spacing) * cosine;
        d.gap_area += area;
        d.bend += bend * bend * area;
      }
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
