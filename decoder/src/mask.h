// Support masks (3.5): an adaptive context arithmetic coder after Langdon and Rissanen 1981, four templates
// of 4 to 22 pixels mixed. A border is the same seen from inside and from outside: all pixels are compared
// with the one to the left. Integers only. Shared with the encoder.
#pragma once
#include "format.h"
#include "mixing.h"
#include "runs.h"

namespace relief {

constexpr int kMaskTemplates = 4;
constexpr uint32_t kMaskSizes[kMaskTemplates] = {1u << 3, 1u << 9, 1u << 15, 1u << 16};

struct MaskModels {
  Logistic logistic;
  Model t3[kMaskSizes[0]], t9[kMaskSizes[1]], t15[kMaskSizes[2]], t21[kMaskSizes[3]];
  int32_t weight[kMaskSizes[1]][kMaskTemplates];  // 16.16, by the 10-pixel template
  RELIEF_COLD void init() {
    logistic.init();
    for (Model& m : t3) m = kModelInit;
    for (Model& m : t9) m = kModelInit;
    for (Model& m : t15) m = kModelInit;
    for (Model& m : t21) m = kModelInit;
    for (auto& set : weight)
      for (int32_t& w : set) w = 23000;  // 0.35
  }
};

// Pixels p[0] .. p[7], 0 or 1, as bits, the first in bit 0.
inline uint32_t pack_pixels(const uint8_t* p) {
  uint64_t v;
  __builtin_memcpy(&v, p, 8);
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
  v = __builtin_bswap64(v);
#endif
  return uint32_t(v * 0x0102040810204080u >> 56);
}

// The pixels around one, as bits from left to right: in the row above from x - 3 to x + 4, in the one above
// that from x - 3 to x + 3, in the third from x - 1 to x + 1; `before`: those to the left, the nearest in bit
// 0.
struct Surroundings {
  uint32_t above, above2, above3, before;

  RELIEF_INLINE void look_up(const uint8_t* p, ptrdiff_t s) {
    above = pack_pixels(p - s - 3);
    above2 = pack_pixels(p - 2 * s - 3);
    above3 = p[-3 * s - 1] | p[-3 * s] << 1 | p[-3 * s + 1] << 2;
  }
  // The pixels of the 16-pixel template, in any order.
  uint32_t any16() const {
    return (before & 7) | (above & 127) << 3 | (above2 & 62) << 9 | (above3 & 2) << 14;
  }

  uint32_t c4() const { return (before & 1) | (above >> 2 & 2) | (above >> 2 & 4) | (above << 1 & 8); }
  uint32_t c10() const { return (before & 3) | (above << 1 & 124) | (above2 << 5 & 896); }
  uint32_t c16() const {
    return c10() | (before & 4) << 8 | (above & 64) << 5 | (above & 1) << 12 | (above2 & 32) << 8 |
           (above2 & 2) << 13 | (above3 & 2) << 14;
  }
  uint32_t c22() const {
    return c16() | (before & 8) << 13 | (above & 128) << 10 | (above3 & 4) << 16 | (above3 & 1) << 19 |
           (above2 & 64) << 14 | (above2 & 1) << 21;
  }
};

// One pixel where several models are asked.
template <class Coder>
RELIEF_INLINE int code_pixel(Coder& coder, MaskModels& models, const Surroundings& around, int bit) {
  const uint32_t side = around.before & 1;
  // which pixels of a template differ from the one to the left, which is its first
  auto compared = [&](uint32_t c, uint32_t size) { return (c ^ (0u - side)) >> 1 & (size - 1); };
  const uint32_t c9 = compared(around.c10(), kMaskSizes[1]);
  Model* const m[kMaskTemplates] = {&models.t3[compared(around.c4(), kMaskSizes[0])], &models.t9[c9],
                                    &models.t15[compared(around.c16(), kMaskSizes[2])],
                                    &models.t21[compared(around.c22(), 1u << 21) * 0x9E3779B1u >> 16]};
  return int(side) ^ code_mixed<kMaskTemplates, kMaskLimit, 14>(coder, models.logistic, m, models.weight[c9],
                                                                bit ^ int(side));
}

// If the pixel before p is deep outside (0) or inside (1), how many from p on are so, by the rows above. At
// most 8.
inline int as_deep(const uint8_t* p, ptrdiff_t s, uint32_t side) {
  const uint64_t all = side * kEachByte;
  return first_byte((load8(p - s + 3) ^ all) | (load8(p - 2 * s + 2) ^ all) | (load8(p - 3 * s) ^ all));
}

// Codes the mask of one patch. `rows`: height rows of width bytes, 0 or 1, each row `stride` bytes apart,
// with at least 3 rows of zeros above and 4 zeros before and after each row (the templates look there).
template <class Coder>
void code_mask(Coder& outer, MaskModels& models, uint8_t* rows, uint32_t width, uint32_t height,
               size_t stride) {
  CoderCopy<Coder> coder(outer);
  const ptrdiff_t s = ptrdiff_t(stride);
  for (uint32_t y = 0; y < height; y++) {
    uint8_t *p = rows + y * stride, *const end = p + width;
    Surroundings around = {0, 0, 0, 0};
    while (p < end) {
      around.look_up(p, s);
      const uint32_t c16 = around.any16();
      if (c16 != 0 && c16 != 0xffff) {
        *p = uint8_t(code_pixel(*coder, models, around, *p));
        around.before = around.before << 1 | *p++;
        continue;
      }
      // deep outside or inside: one model, most pixels
      Model m = models.t15[0];
      const uint32_t side = c16 & 1;
      uint32_t bit;
      for (int more = 0;; more--) {
        bit = side ^ uint32_t(code_bit<kMaskLimit>(*coder, m, *p ^ int(side)));
        *p++ = uint8_t(bit);
        if (bit != side || p >= end) break;
        if (more == 0 && (more = as_deep(p, s, side)) == 0) break;
      }
      models.t15[0] = m;
      around.before = (side ? 14u : 0u) | bit;
    }
  }
}

}  // namespace relief
