#include "restore.h"

namespace relief {

void restore(const Pyramid& p, const uint8_t* mask, const float* z, float step, float* out,
             const Leaves& leaves) {
  const Band& b = p.low[0];
  const size_t w = b.width;
  for (uint32_t y = 0; y < b.height; y++, z += w, out += w) {
    const RestoredRow row = {z,
                             y >= 2 ? z - 2 * w : z,
                             y >= 1 ? z - w : z,
                             y + 1 < b.height ? z + w : z,
                             y + 2 < b.height ? z + 2 * w : z,
                             ptrdiff_t(w),
                             mask + b.at(0, y),
                             ptrdiff_t(b.stride)};
    leaves.restore_row(row, kRestoreLimit * step, out, b.width);
  }
}

}  // namespace relief
