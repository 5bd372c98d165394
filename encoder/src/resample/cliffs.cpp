#include "resample/cliffs.h"

#include <algorithm>
#include <cmath>

#include "resample/clean_mask.h"

namespace relief {
namespace {

constexpr double kTooFar = 0.7;                       // spacings from the surface
constexpr double kSteepCell = 1.5, kSteepEdge = 1.0;  // height differences that are looked at, spacings
constexpr int kRounds = 12;

struct Probe {
  size_t cell;
  Vec3 point;
};

Vec3 position(const ElevationMap& map, const Frame& f, size_t i) {
  const double x = double(map.x0) + double(i % map.width), y = double(map.y0) + double(i / map.width);
  const double z = map.z0 * map.spacing + map.z[i];
  Vec3 p;
  for (int k = 0; k < 3; k++) p[k] = (f.e1[k] * x + f.e2[k] * y) * map.spacing + f.n[k] * z;
  return p;
}

// Points on the steep edges and diagonals of steep cells.
std::vector<Probe> steep_probes(const ElevationMap& map, const Frame& frame) {
  std::vector<Probe> probes;
  const size_t w = map.width;
  for (size_t y = 0; y + 1 < map.height; y++)
    for (size_t x = 0; x + 1 < w; x++) {
      const size_t a = y * w + x, corner[4] = {a, a + 1, a + w, a + w + 1};
      size_t in[4];
      int n = 0;
      float lo = INFINITY, hi = -INFINITY;
      for (size_t i : corner)
        if (map.mask[i]) in[n++] = i, lo = std::min(lo, map.z[i]), hi = std::max(hi, map.z[i]);
      if (n < 3 || hi - lo < kSteepCell * map.spacing) continue;
      for (int i = 0; i < n; i++)
        for (int j = i + 1; j < n; j++) {
          if (std::fabs(map.z[in[i]] - map.z[in[j]]) < kSteepEdge * map.spacing) continue;
          const Vec3 p = position(map, frame, in[i]), q = position(map, frame, in[j]);
          for (double t : {0.5, 0.25, 0.75}) probes.push_back({a, p + t * (q - p)});
        }
    }
  return probes;
}

}  // namespace

size_t cut_cliffs(ElevationMap& map, const Frame& frame, const DistanceToSurface& distance) {
  const size_t before = map.pixels, w = map.width;
  for (int round = 0; round < kRounds; round++) {
    const std::vector<Probe> probes = steep_probes(map, frame);
    if (probes.empty()) break;
    std::vector<Vec3> points;
    for (const Probe& p : probes) points.push_back(p.point);
    const std::vector<float> d = distance(points);
    std::vector<uint8_t> bad(map.mask.size(), 0);  // cells of each pixel that bridge a cliff
    std::vector<size_t> pixels;
    for (size_t i = 0; i < probes.size(); i++) {
      if (d[i] <= kTooFar * map.spacing) continue;
      const size_t a = probes[i].cell;
      for (size_t p : {a, a + 1, a + w, a + w + 1})
        if (map.mask[p]) {
          if (!bad[p]) pixels.push_back(p);
          if (bad[p] < 255) bad[p]++;
        }
    }
    if (pixels.empty()) break;
    std::stable_sort(pixels.begin(), pixels.end(),
                     [&](size_t a, size_t b) { return bad[a] != bad[b] ? bad[a] > bad[b] : a < b; });
    std::vector<char> blocked(map.mask.size(), 0);  // one cut mends its neighbourhood: look again first
    for (size_t p : pixels) {
      if (blocked[p]) continue;
      map.mask[p] = 0;
      const int px = int(p % w), py = int(p / w);
      for (int y = std::max(0, py - 2); y <= std::min(int(map.height) - 1, py + 2); y++)
        for (int x = std::max(0, px - 2); x <= std::min(int(w) - 1, px + 2); x++)
          blocked[size_t(y) * w + size_t(x)] = 1;
    }
  }
  drop_unmeshable(map);
  return before - map.pixels;
}

}  // namespace relief
