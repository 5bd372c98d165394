// Mixing the opinions of several adaptive models on one bit in the logistic domain (Mahoney's lpaq). Integers
// only. Shared with the encoder.
#pragma once
#include "models.h"

namespace relief {

// ln(p / (1 - p)) in 1/256 and its inverse, on 12-bit probabilities; filled by integer interpolation, part of
// the format. stretch keeps away from 0 and 1 as model_p16 does.
struct Logistic {
  static constexpr int kMost = 2047;  // what stretch gives at most
  int16_t stretch[4096];
  uint16_t squashed[2 * kMost + 1];  // times 16, of x + kMost

  static int squash(int x) {  // x in 1/256, -2047 .. 2047 -> 1 .. 4095
    constexpr int16_t kKnot[33] = {1,    2,    3,    6,    10,   16,   27,   45,   73,   120,  194,
                               310,  488,  747,  1101, 1546, 2047, 2549, 2994, 3348, 3607, 3785,
                               3901, 3975, 4022, 4050, 4068, 4079, 4085, 4089, 4092, 4093, 4094};
    if (x > 2047) return 4095;
    if (x < -2047) return 1;
    const int w = x & 127, k = (x >> 7) + 16;
    return (kKnot[k] * (128 - w) + kKnot[k + 1] * w + 64) >> 7;
  }

  RELIEF_COLD void init() {
    int p = 0;
    for (int x = -kMost; x <= kMost; x++) {
      const int v = squash(x);
      squashed[x + kMost] = uint16_t(v << 4);
      for (; p <= v; p++) stretch[p] = int16_t(x);
    }
    for (; p < 4096; p++) stretch[p] = 2047;
    stretch[0] = stretch[1] = stretch[2];
    stretch[4095] = stretch[4094];
  }
};

// N models' opinions on the next bit.
template <int N>
struct Mixed {
  int stretched[N];
  int p16;  // probability of a 1
};

// weight: 16.16, one for each model.
template <int N>
inline Mixed<N> mix(const Logistic& logistic, Model* const* m, const int32_t* weight) {
  Mixed<N> r;
  int64_t dot = 0;
  for (int i = 0; i < N; i++) {
    r.stretched[i] = logistic.stretch[*m[i] >> 20];
    dot += int64_t(weight[i]) * r.stretched[i];
  }
  constexpr int kMost = Logistic::kMost;
  const int64_t x = dot >> 16;
  r.p16 = logistic.squashed[(x > kMost ? kMost : x < -kMost ? -kMost : x) + kMost];
  return r;
}

// Codes a bit. Models adapt up to the count Limit; the weights follow the error by gradient descent, at the
// rate 2^-Rate for errors in 16 bits, modulo 2^32: only hostile bytes lead that far.
template <int N, uint32_t Limit, int Rate, class Coder>
RELIEF_INLINE int code_mixed(Coder& coder, const Logistic& logistic, Model* const* m, int32_t* weight,
                             int bit) {
  const Mixed<N> mixed = mix<N>(logistic, m, weight);
  bit = coder.code(bit, uint32_t(mixed.p16));
  const int error = (bit << 16) - mixed.p16;
  for (int i = 0; i < N; i++) {
    const int32_t change = (mixed.stretched[i] * error + (1 << (Rate - 1))) >> Rate;
    weight[i] = int32_t(uint32_t(weight[i]) + uint32_t(change));
    model_update<Limit>(*m[i], bit);
  }
  return bit;
}

}  // namespace relief
