// The canonical mesh of an elevation map, cell by cell, as the decoder makes it (4.2), for interpolation.
#pragma once
#include "diagonal.h"
#include "resample/elevation_map.h"

namespace relief {

enum class Cell : uint8_t {
  kNone,
  kMain,
  kAnti,
  kNoA,
  kNoB,
  kNoC,
  kNoD
};  // a b / c d: (x,y) (x+1,y) / (x,y+1) (x+1,y+1)

// Shares of the four pixels a, b, c, d in a point of a cell; covered is false where no triangle lies.
struct Shares {
  float a, b, c, d;
  bool covered;
};

inline Shares shares_in(Cell cell, float u, float v) {
  auto below = [&] { return Shares{1 - u, u - v, 0, v, true}; };          // a b d
  auto above = [&] { return Shares{1 - v, 0, v - u, u, true}; };          // a d c
  auto lower = [&] { return Shares{1 - u - v, u, v, 0, true}; };          // a b c
  auto upper = [&] { return Shares{0, 1 - v, 1 - u, u + v - 1, true}; };  // b d c
  constexpr Shares kOutside = {0, 0, 0, 0, false};
  switch (cell) {
    case Cell::kNone:
      return kOutside;
    case Cell::kMain:
      return u >= v ? below() : above();
    case Cell::kAnti:
      return u + v <= 1 ? lower() : upper();
    case Cell::kNoA:
      return u + v >= 1 ? upper() : kOutside;
    case Cell::kNoB:
      return v >= u ? above() : kOutside;
    case Cell::kNoC:
      return u >= v ? below() : kOutside;
    case Cell::kNoD:
      return u + v <= 1 ? lower() : kOutside;
  }
  return kOutside;
}

// The kinds of all cells of a map, (width) * (height), the last row and column none.
inline std::vector<Cell> cells_of(const ElevationMap& map) {
  const int w = int(map.width), h = int(map.height);
  std::vector<Cell> cells(map.mask.size(), Cell::kNone);
  std::vector<int32_t> z(map.mask.size(), 0);
  for (size_t i = 0; i < z.size(); i++)
    if (map.mask[i]) z[i] = to_lattice(map.z[i]);
  for (int y = 0; y + 1 < h; y++)
    for (int x = 0; x + 1 < w; x++) {
      const size_t i = size_t(y) * size_t(w) + size_t(x);
      const uint8_t* m = &map.mask[i];
      const int n = m[0] + m[1] + m[w] + m[w + 1];
      if (n < 3) continue;
      if (n == 3) {
        cells[i] = !m[0] ? Cell::kNoA : !m[1] ? Cell::kNoB : !m[w] ? Cell::kNoC : Cell::kNoD;
        continue;
      }
      const bool predictable = x >= 1 && y >= 1 && x + 2 < w && y + 2 < h && m[-w - 1] && m[-w + 2] &&
                               m[2 * w - 1] && m[2 * w + 2];
      cells[i] = !predictable || predict_main_diagonal(&z[i], w) ? Cell::kMain : Cell::kAnti;
    }
  return cells;
}

// Calls visit(cell's pixel, shares, fine point, u, v) for the fine points of all cells (each point in one
// cell).
template <class Visit>
void each_sample(const ElevationMap& map, const FineRaster& fine, const std::vector<Cell>& cells,
                 Visit visit) {
  for (uint32_t y = 0; y + 1 < map.height; y++)
    for (uint32_t x = 0; x + 1 < map.width; x++) {
      const size_t i = size_t(y) * map.width + x;
      for (int b = 0; b < kOversampling; b++)
        for (int a = 0; a < kOversampling; a++) {
          const size_t j =
              (size_t(y) * kOversampling + size_t(b)) * fine.width + size_t(x) * kOversampling + size_t(a);
          if (!fine.owner[j]) continue;
          visit(i, shares_in(cells[i], float(a) / kOversampling, float(b) / kOversampling), j);
        }
    }
}

}  // namespace relief
