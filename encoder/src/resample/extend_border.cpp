#include "resample/extend_border.h"

namespace relief {
namespace {

constexpr int kReach = kOversampling / 2;  // points of the raster that are half a spacing
constexpr double kFromBorder = 2;          // spacings; most for the face of the pixel beside

// The point of the raster nearest to a pixel that is on the surface: its index, or -1 if there is none within
// reach or it belongs to another patch.
ptrdiff_t nearest_own_point(const FineRaster& fine, int x, int y) {
  ptrdiff_t best = -1;
  int least = kReach * kReach + 1;
  for (int dy = -kReach; dy <= kReach; dy++)
    for (int dx = -kReach; dx <= kReach; dx++) {
      const int square = dx * dx + dy * dy, i = x + dx, j = y + dy;
      if (square >= least || i < 0 || j < 0 || i >= int(fine.width) || j >= int(fine.height)) continue;
      const ptrdiff_t at = ptrdiff_t(j) * ptrdiff_t(fine.width) + i;
      if (fine.owner[size_t(at)]) best = at, least = square;
    }
  return best >= 0 && fine.owner[size_t(best)] == 1 ? best : -1;
}

// The pixel that is the k-th in a circle around one, or -1 beyond the rectangle.
ptrdiff_t beside(const ElevationMap& map, int x, int y, int k) {
  constexpr int kAround[8][2] = {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}};
  const int i = x + kAround[k & 7][0], j = y + kAround[k & 7][1];
  if (i < 0 || j < 0 || i >= int(map.width) || j >= int(map.height)) return -1;
  return ptrdiff_t(j) * ptrdiff_t(map.width) + i;
}

// Whether those of the mask around a pixel are one run: then a pixel more closes no hole and joins nothing.
bool has_one_side(const ElevationMap& map, int x, int y) {
  auto in = [&](int k) {
    const ptrdiff_t at = beside(map, x, y, k);
    return at >= 0 && map.mask[size_t(at)];
  };
  int runs = 0;
  for (int k = 0; k < 8; k++) runs += in(k) && !in(k + 1);
  return runs == 1;
}

// The face of a pixel of this mask beside this one that is near the border, or -1.
int face_beside(const ElevationMap& map, const std::vector<uint8_t>& mask, int x, int y,
                const std::vector<float>& from_border) {
  for (int k = 0; k < 8; k++) {
    const ptrdiff_t at = beside(map, x, y, k);
    const int face = at >= 0 && mask[size_t(at)] ? map.face[size_t(at)] : -1;
    if (face >= 0 && from_border[size_t(face)] < kFromBorder * map.spacing) return face;
  }
  return -1;
}

}  // namespace

void extend_border(ElevationMap& map, const FineRaster& fine, const std::vector<float>& from_border) {
  if (from_border.empty()) return;
  const std::vector<uint8_t> before = map.mask;
  for (int y = 0; y < int(map.height); y++)
    for (int x = 0; x < int(map.width); x++) {
      const size_t at = size_t(y) * map.width + size_t(x);
      if (fine.owner[(size_t(y) * fine.width + size_t(x)) * kOversampling] || !has_one_side(map, x, y))
        continue;
      const ptrdiff_t point = nearest_own_point(fine, x * kOversampling, y * kOversampling);
      const int face = point < 0 ? -1 : face_beside(map, before, x, y, from_border);
      if (face < 0) continue;
      map.mask[at] = 1;
      map.z[at] = fine.z[size_t(point)];
      map.face[at] = face;
      map.pixels++;
    }
}

}  // namespace relief
