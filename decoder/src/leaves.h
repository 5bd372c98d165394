// The innermost loops of the decoder, over rows of numbers: the only code that is compiled for several instruction sets.
//
// leaves.inc has them as plain loops and is compiled once a level: without vectors (the reference), for what every
// processor of the architecture has (SSE2, NEON, WebAssembly SIMD), and on x86-64 for AVX2 as well. Integers, and
// floating point without reassociation or fused operations: all levels give the same bits.
#pragma once
#include <stddef.h>
#include <stdint.h>

namespace relief {

// Weights of the magnitudes around a place of a band: of the one there, of the sum of those to the left and right, and of
// the sum of those above and below.
struct AroundWeights {
  uint8_t here, across, down;
};

struct AboveWeights {
  uint8_t N, NW, NE, NN;
};

// Weighted sums of magnitudes are exact below kSumCap, and at least kSumCap where they are more: magnitudes are cut
// at 4095, and so, about, are their products with a weight. Sixteen terms fit 16 bits.
constexpr int kMagnitudeCap = 4095;
constexpr uint32_t kSumCap = 3072;

struct Leaves {
  // out[i] = min(|q[i]|, kMagnitudeCap)
  void (*magnitudes)(const int32_t* q, uint16_t* out, uint32_t n);

  // The share of a row above in the contexts of a row: its magnitudes from `above[-1]` to `above[n]` and those of the
  // row above it. sum: weighted. near: min(N, 3) << 2 | min(NW, 1) << 4 | min(NE, 1) << 5 | min(NN, 3) << 6.
  void (*weigh_above)(const uint16_t* above, const uint16_t* above2, AboveWeights weights, uint16_t* sum, uint8_t* near,
                      uint32_t n);

  // Adds the weighted magnitudes around the places of a row; `here` from [-1] to [n].
  void (*weigh_around)(const uint16_t* up, const uint16_t* here, const uint16_t* down, AroundWeights weights,
                       uint16_t* sum, uint32_t n);

  // sum[i] += half[i / 2]
  void (*add_doubled)(const uint16_t* half, uint16_t* sum, uint32_t n);

  // edge[i]: 1 where a pixel to the left, right, above, below or above right is outside of the mask, else 0.
  void (*edges)(const uint8_t* mask, ptrdiff_t stride, uint8_t* edge, uint32_t n);
};

enum class Level { kScalar, kVector, kAvx2 };

// The leaves of a level, or null if this build or this machine does not have it.
const Leaves* leaves_of(Level level);

// Those of the best level.
const Leaves& best_leaves();

}  // namespace relief
