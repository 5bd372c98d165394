// Support masks (3.5): an adaptive context arithmetic coder after Langdon and Rissanen 1981, three templates
// of 6 to 22 pixels mixed. A border is the same seen from inside and from outside: all pixels are compared
// with the one to the left. Integers only. Shared with the encoder.
#pragma once
#include "format.h"
#include "mixing.h"
#include "runs.h"

namespace relief {

constexpr int kMaskTemplates = 3;
constexpr uint32_t kMaskSizes[kMaskTemplates] = {1u << 5, 1u << 12, 1u << 14};
constexpr uint32_t kMaskWeights = 1u << 9;

// Deep pixels are coded by so many at once: most differ from nothing around.
constexpr int kMaskGroup = 8;

struct MaskModels {
  Logistic logistic;
  struct {
    Model t5[kMaskSizes[0]], t12[kMaskSizes[1]], t21[kMaskSizes[2]];
    // of deep pixels: whether one differs, whether any of a group does, and if so, which
    Model deep, group, in_group[kMaskGroup - 1];
  } of;
  int32_t weight[kMaskWeights][kMaskTemplates];  // 16.16, by the 10-pixel template
  RELIEF_COLD void init() {
    logistic.init();
    constexpr Model kInit = kModelInit;
    for (size_t i = 0; i < sizeof of; i += sizeof kInit)
      __builtin_memcpy(reinterpret_cast<uint8_t*>(&of) + i, &kInit, sizeof kInit);
    for (auto& set : weight)
      for (int32_t& w : set) w = 30000;  // 0.46
  }
};

// The pixels around one, as bits from the right-most of its own row to the left, then from left to right: 4
// before it, 8 in the row above from x - 3 on, 7 in the one above that from x - 3 on, 3 in the third from
// x - 1 on.
RELIEF_INLINE uint32_t look_around(const uint8_t* p, ptrdiff_t s, uint32_t before) {
  return (before & 15) | pack_pixels(p - s - 3) << 4 | (pack_pixels(p - 2 * s - 3) & 127) << 12 |
         uint32_t(p[-3 * s - 1] | p[-3 * s] << 1 | p[-3 * s + 1] << 2) << 19;
}
constexpr uint32_t kAround16 = 7 | 127u << 4 | 31u << 13 | 1u << 20;  // 16 that tell whether it is deep

// One pixel where several models are asked.
template <class Coder>
RELIEF_INLINE int code_pixel(Coder& coder, MaskModels& models, uint32_t around, int bit) {
  const uint32_t side = around & 1;
  const uint32_t c21 =
      (around ^ (0u - side)) & ((1u << 22) - 1);  // those that differ from the one to the left
  const uint32_t c5 = (c21 >> 1 & 1) | (c21 >> 5 & 14) | (c21 >> 11 & 16);
  const uint32_t c9 = (c21 >> 1 & 1) | (c21 >> 4 & 62) | (c21 >> 8 & 448);
  const uint32_t c12 = (c21 >> 1 & 1) | (c21 >> 4 & 126) | (c21 >> 6 & 3968);
  Model* const m[kMaskTemplates] = {&models.of.t5[c5], &models.of.t12[c12],
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
      const uint32_t differs = uint32_t(code_seldom<kMaskLimit>(coder, models.of.deep, *p ^ int(side)));
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
