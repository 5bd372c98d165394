#include "coarse_mask.h"

namespace relief {
namespace {

constexpr uint8_t kIn = 1, kQueued = 2;

// Pixels around one, counter-clockwise in an image whose rows go down; cell k lies between 2k and 2k + 2.
constexpr int8_t kAround[8][2] = {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}};

bool one_fan(const uint8_t* p, ptrdiff_t stride) {
  int in[8], fans = 0;
  bool covered[4], any = false;
  for (int i = 0; i < 8; i++) in[i] = p[kAround[i][1] * stride + kAround[i][0]] & kIn;
  for (int k = 0; k < 4; k++) {
    covered[k] = in[2 * k] + in[2 * k + 1] + in[(2 * k + 2) % 8] >= 2;
    any |= covered[k];
  }
  for (int k = 0; k < 4; k++) fans += covered[k] && !(covered[(k + 3) % 4] && in[2 * k]);  // one begins here
  return any && fans < 2;
}

}  // namespace

void tidy_mask(uint8_t* mask, uint32_t w, uint32_t h, ptrdiff_t stride, uint32_t* queue) {
  for (uint32_t y = 0; y < h; y++)
    for (uint32_t x = 0; x < w; x++) {
      if (!mask[ptrdiff_t(y) * stride + x]) continue;
      uint32_t queued = 0;
      queue[queued++] = y << 16 | x;  // the last is looked at first
      while (queued > 0) {
        const uint32_t last = queue[--queued];
        uint8_t* const p = mask + ptrdiff_t(last >> 16) * stride + (last & 0xffff);
        *p &= kIn;
        if (one_fan(p, stride)) continue;
        *p = 0;
        for (const auto& d : kAround) {
          uint8_t* const q = p + d[1] * stride + d[0];
          if (*q != kIn) continue;
          *q |= kQueued;
          queue[queued++] = uint32_t((int(last >> 16) + d[1]) << 16 | (int(last & 0xffff) + d[0]));
        }
      }
    }
}

}  // namespace relief
