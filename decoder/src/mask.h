// Support masks (3.5): an adaptive context arithmetic coder after Langdon and Rissanen 1981, four templates
// of 4 to 22 pixels mixed in the logistic domain (Mahoney's lpaq). Integers only. Shared with the encoder.
#pragma once
#include "format.h"
#include "models.h"

namespace relief {

constexpr int kMaskTemplates = 4;
constexpr uint32_t kMaskSizes[kMaskTemplates] = {1u << 4, 1u << 10, 1u << 16, 1u << 16};

// ln(p / (1 - p)) in 1/256 and its inverse, on 12-bit probabilities; filled by integer interpolation, part of
// the format.
struct Logistic {
  int16_t stretch[4096];

  static int squash(int x) {  // x in 1/256, -2047 .. 2047 -> 1 .. 4095
    constexpr int kKnot[33] = {1,    2,    3,    6,    10,   16,   27,   45,   73,   120,  194,
                               310,  488,  747,  1101, 1546, 2047, 2549, 2994, 3348, 3607, 3785,
                               3901, 3975, 4022, 4050, 4068, 4079, 4085, 4089, 4092, 4093, 4094};
    if (x > 2047) return 4095;
    if (x < -2047) return 1;
    const int w = x & 127, k = (x >> 7) + 16;
    return (kKnot[k] * (128 - w) + kKnot[k + 1] * w + 64) >> 7;
  }

  void init() {
    int p = 0;
    for (int x = -2047; x <= 2047; x++) {
      const int v = squash(x);
      for (; p <= v; p++) stretch[p] = int16_t(x);
    }
    for (; p < 4096; p++) stretch[p] = 2047;
  }
};

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

// One pixel whose models' probabilities are mixed; the weights follow the error by gradient descent.
template <class Coder>
int code_mixed(Coder& coder, MaskModels& models, Model* const* m, int32_t* w, int bit) {
  int st[kMaskTemplates];
  int64_t dot = 0;
  for (int i = 0; i < kMaskTemplates; i++) {
    st[i] = models.logistic.stretch[model_p16(*m[i]) >> 4];
    dot += int64_t(w[i]) * st[i];
  }
  int64_t x = dot >> 16;
  x = x > 2047 ? 2047 : x < -2047 ? -2047 : x;
  const int p12 = Logistic::squash(int(x));
  bit = coder.code(bit, uint32_t(p12) << 4);
  const int error = ((bit << 12) - p12) * 16;
  for (int i = 0; i < kMaskTemplates; i++) {
    w[i] += (st[i] * error + 0x2000) >> 14;
    model_update<kMaskLimit>(*m[i], bit);
  }
  return bit;
}

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
      p[0] = uint8_t(code_mixed(coder, models, m, models.weight[c10], p[0]));
    }
  }
}

}  // namespace relief
