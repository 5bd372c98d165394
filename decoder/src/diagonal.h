// The diagonal of a full cell. Shared with the encoder.
#pragma once
#include <stdint.h>

namespace relief {

// Predicted without bits: the diagonal whose middle is closer to a cubic through the neighbours along both
// diagonals. z: integer heights, `stride` apart by row, at pixel (x, y) of the cell; the pixels (x-1, y-1),
// (x+2, y+2), (x+2, y-1) and (x-1, y+2) must be in the mask. True: from (x, y) to (x+1, y+1). Everything is
// scaled by 32.
inline bool predict_main_diagonal(const int32_t* z, ptrdiff_t stride) {
  const int32_t main = z[0] + z[stride + 1], anti = z[1] + z[stride];
  const int32_t estimate =
      9 * (main + anti) - z[-stride - 1] - z[2 * stride + 2] - z[-stride + 2] - z[2 * stride - 1];
  const int32_t dm = 16 * main - estimate, da = 16 * anti - estimate;
  return (dm < 0 ? -dm : dm) <= (da < 0 ? -da : da);
}

}  // namespace relief
