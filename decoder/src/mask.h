// Support masks (3.5): an adaptive context arithmetic coder after Langdon and Rissanen 1981, four templates
// of 4 to 22 pixels mixed. Integers only. Shared with the encoder.
#pragma once
#include "format.h"
#include "mixing.h"

namespace relief {

constexpr int kMaskTemplates = 4;
constexpr uint32_t kMaskSizes[kMaskTemplates] = {1u << 4, 1u << 10, 1u << 16, 1u << 16};

struct MaskModels {
  Logistic logistic;
  Model t4[kMaskSizes[0]], t10[kMaskSizes[1]], t16[kMaskSizes[2]], t22[kMaskSizes[3]];
  int32_t weight[1024][kMaskTemplates];  // 16.16, by the 10-pixel template
  void init() {
    logistic.init();
    for (Model& m : t4) m = kModelInit;
    for (Model& m : t10) m = kModelInit;
    for (Model& m : t16) m = kModelInit;
    for (Model& m : t22) m = kModelInit;
    for (auto& set : weight)
      for (int32_t& w : set) w = 23000;  // 0.35
  }
};

// Codes the mask of one patch. `rows`: height rows of width bytes, 0 or 1, each row `stride` bytes apart,
// with at least 3 rows of zeros above and 4 zeros before and after each row (the templates look there).
template <class Coder>
void code_mask(Coder& coder, MaskModels& models, uint8_t* rows, uint32_t width, uint32_t height,
               size_t stride) {
  const ptrdiff_t s = ptrdiff_t(stride);
  for (uint32_t y = 0; y < height; y++) {
    uint8_t* row = rows + y * stride;
    for (uint32_t x = 0; x < width; x++) {
      uint8_t* p = row + x;
      const uint32_t c10 = p[-1] | p[-2] << 1 | p[-s - 2] << 2 | p[-s - 1] << 3 | p[-s] << 4 |
                           p[-s + 1] << 5 | p[-s + 2] << 6 | p[-2 * s - 1] << 7 | p[-2 * s] << 8 |
                           p[-2 * s + 1] << 9;
      const uint32_t c16 = c10 | p[-3] << 10 | p[-s + 3] << 11 | p[-s - 3] << 12 | p[-2 * s + 2] << 13 |
                           p[-2 * s - 2] << 14 | p[-3 * s] << 15;
      if (c16 == 0 || c16 == 0xffff) {  // deep outside or inside: one model, most pixels
        p[0] = uint8_t(code_bit<1000>(coder, models.t16[c16], p[0]));
        continue;
      }
      const uint32_t c22 = c16 | p[-4] << 16 | p[-s + 4] << 17 | uint32_t(p[-3 * s + 1]) << 18 |
                           uint32_t(p[-3 * s - 1]) << 19 | uint32_t(p[-2 * s + 3]) << 20 |
                           uint32_t(p[-2 * s - 3]) << 21;
      const uint32_t c4 = p[-1] | p[-s] << 1 | p[-s + 1] << 2 | p[-s - 1] << 3;
      Model* const m[kMaskTemplates] = {&models.t4[c4], &models.t10[c10], &models.t16[c16],
                                        &models.t22[(c22 * 0x9E3779B1u) >> 16]};
      p[0] = uint8_t(
          code_mixed<kMaskTemplates, kMaskLimit, 14>(coder, models.logistic, m, models.weight[c10], p[0]));
    }
  }
}

}  // namespace relief
