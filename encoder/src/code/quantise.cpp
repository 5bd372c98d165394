#include "code/quantise.h"

#include <algorithm>
#include <cmath>

namespace relief {

void quantise_low(const WaveletImage& image, float step, int32_t* q) {
  const Band& b = image.pyramid.low[kLevels];
  for (uint32_t y = 0; y < b.height; y++)
    for (uint32_t x = 0; x < b.width; x++) {
      const size_t i = b.at(x, y);
      if (image.mask[i]) q[i] = int32_t(std::lround(image.value[i] / step));
    }
}

float bits_of(const Logistic& logistic, const Context& c, const BitModels& b, int bit) {
  const uint32_t p16 =
      c.activity == 0 ? model_p16(*b.m[0]) : uint32_t(mix<2>(logistic, b.m, b.weight).p16);
  return bit_cost(bit, p16);
}

float tail_bits(int32_t k) { return 2 * std::log2(float(k - kUnary + 1)) + 1; }

namespace {

constexpr float kTowardsZero = 0.03f;  // where values lie in the intervals of the scalar quantiser

float magnitude_bits(CoefficientModels& models, const Context& c, int level, int type, int32_t mag) {
  const BitModels zero = zero_models(models, c, level, type, 0);
  if (mag == 0) return bits_of(models.logistic, c, zero, 0);
  float bits = bits_of(models.logistic, c, zero, 1) + kSignBits;
  const int32_t end = std::min(mag, kUnary);
  for (int32_t k = 1; k < end; k++)
    bits += bits_of(models.logistic, c, greater_models(models, c, level, type, k), 1);
  if (mag < kUnary) return bits + bits_of(models.logistic, c, greater_models(models, c, level, type, mag), 0);
  return bits + tail_bits(mag);
}

}  // namespace

double estimate_band(CountingCoder& coder, CoefficientModels& models, const WaveletImage& image, int level,
                     int type, float step, float trade, int32_t* q) {
  const Band& b = image.pyramid.high[level][type];
  const float band = step * band_step(level, type), inverse = 1 / band;
  double squared = 0;
  for (uint32_t y = 0; y < b.height; y++) {
    const size_t row = b.at(0, y);
    for (uint32_t x = 0; x < b.width; x++) {
      const size_t i = row + x;
      if (!image.mask[i]) continue;
      const float v = image.value[i] * inverse, a = std::fabs(v);
      const Context c = context_at(image.pyramid, q, image.mask.data(), level, type, x, y);
      auto error = [&](int32_t k) {
        const float d = a - (k ? float(k) - kTowardsZero : 0.0f);
        return d * d;
      };
      int32_t best = 0;
      float best_cost = error(0) + trade * magnitude_bits(models, c, level, type, 0);
      const int32_t nearest = int32_t(a + 0.5f + kTowardsZero);
      for (int32_t k = nearest; k > 0 && k >= nearest - 1; k--) {
        const float cost = error(k) + trade * magnitude_bits(models, c, level, type, k);
        if (cost < best_cost) best_cost = cost, best = k;
      }
      q[i] = v < 0 ? -2 * best : 2 * best;
      squared += error(best);
      int state = 0;
      code_coefficient(coder, models, c, level, type, state, q[i],
                       [&] { return sign_context(q + i, ptrdiff_t(b.stride)); });
    }
  }
  return squared * step * step;
}

}  // namespace relief
