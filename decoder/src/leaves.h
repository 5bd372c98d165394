// The innermost loops of the decoder, over rows of numbers: the only code that is compiled for several
// instruction sets.
//
// leaves.inc has them as plain loops and is compiled once a level: without vectors (the reference), for what
// every processor of the architecture has (SSE2, NEON, WebAssembly SIMD), and on x86-64 for AVX2 as well.
// Integers, and floating point without reassociation or fused operations: all levels give the same bits.
#pragma once
#include <stddef.h>
#include <stdint.h>

namespace relief {

// Weights of the magnitudes around a place of a band: of the one there, of the sum of those to the left and
// right, and of the sum of those above and below.
struct AroundWeights {
  uint8_t here, across, down;
};

struct AboveWeights {
  uint8_t N, NW, NE, NN;
};

// Weighted sums of magnitudes are exact below kSumCap, and at least kSumCap where they are more: magnitudes
// are cut at 4095, and so, about, are their products with a weight. Sixteen terms fit 16 bits.
constexpr int kMagnitudeCap = 4095;
constexpr uint32_t kSumCap = 3072;

// A row of elevations, those around it, and its mask, each `stride` from row to row. Where a row is beyond
// the patch, its mask is zero and its values may be any row.
struct RestoredRow {
  const float *values, *up2, *up, *down, *down2;
  ptrdiff_t stride;
  const uint8_t* mask;
  ptrdiff_t mask_stride;
};

// A row of a patch in space: position = (origin + x * along) + z * normal, lattice units; x goes by 2^level.
struct RowFrame {
  float origin[3], along[3], normal[3];
  int level;
};

constexpr uint32_t kBlock = 8;

// The loops over spans of coefficients work on blocks of this many, beyond n up to the end of the last one.
// In a pyramid there is always a plane behind the one read, and margins.
constexpr uint32_t kSpanBlock = 16;

struct Leaves {
  // The coded magnitudes: out[i] = min((|q[i]| + 1) / 2, kMagnitudeCap)
  void (*magnitudes)(const int32_t* q, uint16_t* out, uint32_t n);

  // The share of a row above in the contexts of a row: its magnitudes from `above[-1]` to `above[n]` and
  // those of the row above it. sum: weighted. near: min(N, 3) << 2 | min(NW, 1) << 4 | min(NE, 1) << 5 |
  // min(NN, 3) << 6.
  void (*weigh_above)(const uint16_t* above, const uint16_t* above2, AboveWeights weights, uint16_t* sum,
                      uint8_t* near, uint32_t n);

  // Adds the weighted magnitudes around the places of a row; `here` from [-1] to [n].
  void (*weigh_around)(const uint16_t* up, const uint16_t* here, const uint16_t* down, AroundWeights weights,
                       uint16_t* sum, uint32_t n);

  // sum[i] += half[i / 2]
  void (*add_doubled)(const uint16_t* half, uint16_t* sum, uint32_t n);

  // edge[i]: 1 where a pixel to the left, right, above, below or above right is outside of the mask, else 0.
  void (*edges)(const uint8_t* mask, ptrdiff_t stride, uint8_t* edge, uint32_t n);

  // A row of a mask to the masks of its low ((n + 1) / 2) and its high half (n / 2): see wavelet.h.
  void (*split_mask)(const uint8_t* mask, uint8_t* low, uint8_t* high, uint32_t n);

  void (*dequantise)(const int32_t* q, float step, float* out, uint32_t n);

  // values[i] *= factor. Up to the end of the last block of kBlock.
  void (*scale)(float* values, float factor, uint32_t n);

  // values[i] += factor * (before[i] + after[i]). Up to the end of the last block of kBlock.
  void (*lift)(float* values, const float* before, const float* after, float factor, uint32_t n);

  // Even and odd samples to a row of n.
  void (*join_row)(const float* even, const float* odd, float* out, uint32_t n);

  // A row of elevations with its restoration, see restore.h. Reads kMargin values before the row
  // and kMargin behind its last block of kBlock, and writes up to the end of that.
  void (*restore_row)(const RestoredRow& row, float limit, float* out, uint32_t n);

  // out[i] = to_lattice(z[i])
  void (*heights)(const float* z, int32_t* out, uint32_t n);

  // Lattice positions of pixels (x, y), (x + 2^level, y) ... of a patch, 3 floats each.
  void (*place_row)(const RowFrame& frame, int32_t x, const float* z, float* positions, uint32_t n);

  // Pixels of each cell, or 0 if they are fewer than 3. mask: of the cell's first pixel.
  void (*count_cells)(const uint8_t* mask, ptrdiff_t stride, uint8_t* cells, uint32_t n);

  // Whether any pixel of a row is in no covered cell. cells: the cell of which it is the first pixel.
  bool (*any_stray)(const uint8_t* mask, const uint8_t* cells, ptrdiff_t stride, uint32_t n);

  // 1 for covered cells that have a side without a covered cell across.
  void (*border_cells)(const uint8_t* cells, ptrdiff_t stride, uint8_t* border, uint32_t n);

  // The predicted diagonals of cells (see diagonal.h): 1 for the main one, also where a pixel for the
  // prediction is missing. z, mask: of the cell's first pixel.
  void (*diagonals)(const int32_t* z, ptrdiff_t z_stride, const uint8_t* mask, ptrdiff_t stride,
                    uint8_t* main, uint32_t n);

  // Vectors of 3 floats to unit length, (.., .., 1) where the square of the length is zero.
  void (*normalise)(float* vectors, uint32_t n);

  // The least and the largest of n vectors of 3 floats, component by component; n is not 0.
  void (*bounds)(const float* vectors, uint32_t n, float low[3], float high[3]);

  // Lattice to model coordinates, 3 a vertex: p = origin + scale * p.
  void (*place)(const float origin[3], float scale, float* positions, uint32_t n);
};

enum class Level { kScalar, kVector, kAvx2 };

// The leaves of a level, or null if this build or this machine does not have it.
const Leaves* leaves_of(Level level);

// Those of the best level.
const Leaves& best_leaves();

}  // namespace relief
