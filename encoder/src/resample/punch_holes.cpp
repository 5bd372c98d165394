#include "resample/punch_holes.h"

#include <algorithm>
#include <cmath>

namespace relief {
namespace {

constexpr double kSmall = 1.5;  // radius of a loop that a pixel stands for, spacings
constexpr int kRoom = 2;        // pixels around it, so that the border nowhere touches itself

// Whether all pixels around one are in the mask: then the hole there is one of its own, no part of a gap.
bool is_inside(const ElevationMap& map, int x, int y) {
  if (x < kRoom || y < kRoom || x + kRoom >= int(map.width) || y + kRoom >= int(map.height)) return false;
  for (int j = y - kRoom; j <= y + kRoom; j++)
    for (int i = x - kRoom; i <= x + kRoom; i++)
      if (!map.mask[size_t(j) * map.width + size_t(i)]) return false;
  return true;
}

}  // namespace

void punch_holes(ElevationMap& map, const PatchFaces& patch) {
  const Frame& frame = patch.frame;
  for (const auto& loop : patch.loops) {
    if (loop.radius > kSmall * map.spacing) continue;
    double at[2] = {0, 0};
    for (int k = 0; k < 3; k++)
      at[0] += loop.middle[k] * frame.e1[k] / map.spacing,
          at[1] += loop.middle[k] * frame.e2[k] / map.spacing;
    const int x = int(std::lround(at[0])) - map.x0, y = int(std::lround(at[1])) - map.y0;
    if (!is_inside(map, x, y)) continue;
    map.mask[size_t(y) * map.width + size_t(x)] = 0;
    map.pixels--;
  }
}

}  // namespace relief
