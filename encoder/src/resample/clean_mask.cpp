#include "resample/clean_mask.h"

#include <algorithm>

namespace relief {
namespace {

size_t mask_size(const ElevationMap& map) {
  return size_t(std::count(map.mask.begin(), map.mask.end(), uint8_t(1)));
}

// Connected areas of equal mask value (4-neighbours); visit(value, touches the rim, pixels).
template <class Visit>
void each_area(const ElevationMap& map, Visit visit) {
  const int w = int(map.width), h = int(map.height);
  std::vector<char> seen(map.mask.size(), 0);
  std::vector<int> area;
  for (size_t start = 0; start < map.mask.size(); start++) {
    if (seen[start]) continue;
    const uint8_t value = map.mask[start];
    area.assign(1, int(start));
    seen[start] = 1;
    bool rim = false;
    for (size_t i = 0; i < area.size(); i++) {
      const int x = area[i] % w, y = area[i] / w;
      rim = rim || x == 0 || y == 0 || x == w - 1 || y == h - 1;
      const int next[4] = {x > 0 ? area[i] - 1 : -1, x + 1 < w ? area[i] + 1 : -1, y > 0 ? area[i] - w : -1,
                           y + 1 < h ? area[i] + w : -1};
      for (int j : next)
        if (j >= 0 && !seen[j] && map.mask[j] == value) seen[j] = 1, area.push_back(j);
    }
    visit(value, rim, area);
  }
}

}  // namespace

void smooth_border(ElevationMap& map, const FineRaster& fine) {
  const int w = int(map.width), h = int(map.height);
  const std::vector<uint8_t> before = map.mask;
  // a sum over the 3 by 3 around a pixel
  auto around = [](int x, int y, auto value) {
    int sum = 0;
    for (int dy = -1; dy <= 1; dy++)
      for (int dx = -1; dx <= 1; dx++) sum += value(x + dx, y + dy);
    return sum;
  };
  auto inside = [&](int x, int y) { return int(before[size_t(y) * size_t(w) + size_t(x)]); };
  auto has_surface = [&](int x, int y) {
    return fine.owner[(size_t(y) * fine.width + size_t(x)) * kOversampling] != 0;
  };
  for (int y = 1; y + 1 < h; y++)
    for (int x = 1; x + 1 < w; x++) {
      const int n = around(x, y, inside);
      if (n == 0 || n == 9 || inside(x, y) == (n > 4)) continue;
      if (around(x, y, has_surface) == 9) map.mask[size_t(y) * size_t(w) + size_t(x)] = n > 4;
    }
  map.pixels = mask_size(map);
}

void drop_unmeshable(ElevationMap& map) {
  const int w = int(map.width), h = int(map.height);
  auto& m = map.mask;
  auto in = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < w && y < h && m[size_t(y) * size_t(w) + size_t(x)];
  };
  auto covered = [&](int x, int y) { return in(x, y) + in(x + 1, y) + in(x, y + 1) + in(x + 1, y + 1) >= 3; };
  for (bool changed = true; changed;) {
    changed = false;
    for (int y = 0; y < h; y++)
      for (int x = 0; x < w; x++) {
        if (!in(x, y)) continue;
        // the cells around, counter-clockwise, and the pixels on the sides between them
        const bool cell[4] = {covered(x, y), covered(x - 1, y), covered(x - 1, y - 1), covered(x, y - 1)};
        const bool side[4] = {in(x, y + 1), in(x - 1, y), in(x, y - 1), in(x + 1, y)};
        int fans = 0, cells = 0;
        for (int q = 0; q < 4; q++) {
          cells += cell[q];
          fans += cell[q] && !(cell[(q + 1) & 3] && side[q]);
        }
        // four covered cells in a ring are one fan that is closed, or open at one missing side pixel
        if (cells == 0 || fans > 1) {
          m[size_t(y) * size_t(w) + size_t(x)] = 0;
          changed = true;
        }
      }
  }
  map.pixels = mask_size(map);
}

void drop_islands(ElevationMap& map) {
  constexpr size_t kSpeck = 8;
  size_t largest = 0;
  each_area(map, [&](uint8_t value, bool, const std::vector<int>& area) {
    if (value) largest = std::max(largest, area.size());
  });
  each_area(map, [&](uint8_t value, bool, const std::vector<int>& area) {
    if (!value || area.size() >= kSpeck || area.size() == largest) return;
    for (int i : area) map.mask[size_t(i)] = 0;
  });
  map.pixels = mask_size(map);
}

void clean_mask(ElevationMap& map, const FineRaster& fine) {
  each_area(map, [&](uint8_t value, bool rim, const std::vector<int>& area) {
    if (value && area.size() < 4) {
      for (int i : area) map.mask[size_t(i)] = 0;
      return;
    }
    if (value || rim || area.size() > 12) return;
    for (int i : area) {  // only where there is a surface
      const size_t x = size_t(i) % map.width, y = size_t(i) / map.width;
      if (!fine.owner[(y * fine.width + x) * kOversampling]) return;
    }
    for (int i : area) map.mask[size_t(i)] = 1;
  });
  drop_unmeshable(map);
}

}  // namespace relief
