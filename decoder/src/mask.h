// Support masks (3.5): an adaptive context arithmetic coder after Langdon and Rissanen 1981, four templates
// of 4 to 22 pixels mixed. A border is the same seen from inside and from outside: all pixels are compared
// with the one to the left. Integers only. Shared with the encoder.
#pragma once
#include "format.h"
#include "mixing.h"
#include "runs.h"

namespace relief {

constexpr int kMaskTemplates = 4;
constexpr uint32_t kMaskSizes[kMaskTemplates] = {1u << 3, 1u << 9, 1u << 15, 1u << 14};

// Deep pixels are coded by so many at once: most differ from nothing around.
constexpr int kMaskGroup = 8;

struct MaskModels {
  Logistic logistic;
  struct {
    Model t3[kMaskSizes[0]], t9[kMaskSizes[1]], t15[kMaskSizes[2]], t21[kMaskSizes[3]];
    Model group, in_group[kMaskGroup - 1];  // of deep pixels: whether any differs, and if so, which
  } of;
  int32_t weight[kMaskSizes[1]][kMaskTemplates];  // 16.16, by the 10-pixel template
  RELIEF_COLD void init() {
    logistic.init();
    constexpr Model kInit = kModelInit;
    for (size_t i = 0; i < sizeof of; i += sizeof kInit)
      __builtin_memcpy(reinterpret_cast<uint8_t*>(&of) + i, &kInit, sizeof kInit);
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

// The pixels around one, as bits from the right-most of its own row to the left, then from left to right: 4
// before it, 8 in the row above from x - 3 on, 7 in the one above that from x - 3 on, 3 in the third from
// x - 1 on.
RELIEF_INLINE uint32_t look_around(const uint8_t* p, ptrdiff_t s, uint32_t before) {
  return (before & 15) | pack_pixels(p - s - 3) << 4 | (pack_pixels(p - 2 * s - 3) & 127) << 12 |
         uint32_t(p[-3 * s - 1] | p[-3 * s] << 1 | p[-3 * s + 1] << 2) << 19;
}
constexpr uint32_t kAround16 = 7 | 127u << 4 | 31u << 13 | 1u << 20;  // those of the 16-pixel template

// One pixel where several models are asked.
template <class Coder>
RELIEF_INLINE int code_pixel(Coder& coder, MaskModels& models, uint32_t around, int bit) {
  const uint32_t side = around & 1;
  const uint32_t c21 =
      (around ^ (0u - side)) & ((1u << 22) - 1);  // those that differ from the one to the left
  const uint32_t c9 = (c21 >> 1 & 1) | (c21 >> 4 & 62) | (c21 >> 8 & 448);
  const uint32_t c15 = (c21 >> 1 & 3) | (c21 >> 2 & 508) | (c21 >> 4 & 15872) | (c21 >> 6 & 16384);
  Model* const m[kMaskTemplates] = {&models.of.t3[c21 >> 6 & 7], &models.of.t9[c9], &models.of.t15[c15],
                                    &models.of.t21[c21 * 0x9E3779B1u >> 18]};
  return int(side) ^ code_mixed<kMaskTemplates, kMaskLimit, 14>(coder, models.logistic, m, models.weight[c9],
                                                                bit ^ int(side));
}

// If the pixel before p is deep outside (0) or inside (1), how many from p on are so, by the rows above. At
// most kMaskGroup.
inline int as_deep(const uint8_t* p, ptrdiff_t s, uint32_t side) {
  const uint64_t all = side * kEachByte;
  return first_byte((load8(p - s + 3) ^ all) | (load8(p - 2 * s + 2) ^ all) | (load8(p - 3 * s) ^ all));
}

// A group of deep pixels. Returns the one after the first that differs, or null if none does.
template <class Coder>
RELIEF_INLINE uint8_t* code_group(Coder& coder, MaskModels& models, uint8_t* p, uint32_t side) {
  const uint64_t all = side * kEachByte;
  const int same = Coder::kEncoding ? first_byte(load8(p) ^ all) : 0;
  const int differs = code_seldom<kMaskLimit>(coder, models.of.group, same < kMaskGroup);
  int i = 0;
  if (differs)
    while (i < kMaskGroup - 1 && !code_seldom<kMaskLimit>(coder, models.of.in_group[i], i == same)) i++;
  if (!Coder::kEncoding) __builtin_memcpy(p, &all, sizeof all);
  if (!differs) return nullptr;
  p[i] = uint8_t(side ^ 1);
  return p + i + 1;
}

// Deep pixels from p on, of which the first is known to be so, until one differs or is not deep by the rows
// above, or the row ends. Returns the next pixel.
template <class Coder>
RELIEF_INLINE uint8_t* code_deep(Coder& coder, MaskModels& models, uint8_t* p, const uint8_t* end,
                                 ptrdiff_t s, uint32_t side) {
  for (int known = 1; known > 0; known = p < end ? as_deep(p, s, side) : 0) {
    if (known == kMaskGroup && end - p >= kMaskGroup) {
      if (uint8_t* const next = code_group(coder, models, p, side)) return next;
      p += kMaskGroup;
      continue;
    }
    for (; known > 0 && p < end; known--) {
      const uint32_t differs = uint32_t(code_seldom<kMaskLimit>(coder, models.of.t15[0], *p ^ int(side)));
      *p++ = uint8_t(side ^ differs);
      if (differs) return p;
    }
  }
  return p;
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
    uint32_t before = 0;  // pixels to the left, the nearest in bit 0
    while (p < end) {
      const uint32_t around = look_around(p, s, before), c16 = around & kAround16;
      if (c16 != 0 && c16 != kAround16) {
        *p = uint8_t(code_pixel(*coder, models, around, *p));
        before = before << 1 | *p++;
        continue;
      }
      // deep outside or inside: most pixels
      const uint32_t side = c16 & 1;
      p = code_deep(*coder, models, p, end, s, side);
      before = (side ? 14u : 0u) | p[-1];
    }
  }
}

}  // namespace relief
