// Shape-adaptive 9/7 wavelet (3.5; Li and Li 2000) with linear extension at the ends of segments.
//
// A row or column of a patch falls into segments of mask pixels. Each is lifted alone, with the parity of its
// global position. Where a sample has no neighbour on one side, the first three lifting steps take 2 x[i+-1]
// - x[i+-3] in its place if the segment reaches that far, else x[i+-1]; the fourth always mirrors. A segment
// of one sample goes to the low band, times sqrt(2).
#pragma once
#include "format.h"
#include "leaves.h"

namespace relief {

// Lifting coefficients of the 9/7 and the scale of the low band. Part of the format.
constexpr float kLift[4] = {-1.586134342f, -0.05298011854f, 0.8829110762f, 0.4435068522f};
constexpr float kLowScale = 1.149604398f, kHighScale = 1 / kLowScale;
constexpr float kSqrt2 = 1.41421356f, kSqrtHalf = 0.70710678f;

// All of an inverse level's scales come first, as lifting is linear: those of the low band and of the high
// one both ways, which is 1 of the others, and of a segment of one sample what makes good for them.
constexpr float kCoarseScale = kHighScale * kHighScale, kDetailScale = kLowScale * kLowScale;
constexpr float kAloneScale = kSqrtHalf * kLowScale;

// Fills the masks of all bands from the mask in low[0]. m: the patch's planes, zero outside of low[0].
// scratch: at least 2 * (w / 2 + 1) * (h + 2) bytes.
void build_masks(const Pyramid& p, uint8_t* m, uint8_t* scratch, const Leaves& leaves = best_leaves());

// Inverse transform of a patch, down to the elevations of a level (0: all of it).
//   q, m      planes of quantised coefficients and masks
//   step      quantisation step of the patch, lattice units
//   scratch   wavelet_scratch(w, h) floats, 8-byte aligned
// Returns elevations of low[level], row by row without margin (inside scratch, kMargin floats from its
// start), undefined outside of the mask.
const float* inverse_wavelet(const Pyramid& p, const int32_t* q, const uint8_t* m, float step, float* scratch,
                             const Leaves& leaves = best_leaves(), int level = 0);

// Values of the patch with what restoration reads before and behind them (see restore.h).
constexpr size_t wavelet_values(size_t w, size_t h) { return kMargin + w * h + kMargin + kBlock; }

// Samples of a row of a half, with those that fill its last block, and words of its mask.
constexpr size_t half_stride(size_t w) { return (w + kBlock - 1) / kBlock * kBlock; }
constexpr size_t mask_words(size_t w) { return (w + 63) / 64; }

// Rows of zeros above and below the mask of a half: ends of segments look three rows away.
constexpr size_t kMaskRows = 3;

// What inverse_wavelet takes: the values; both halves, those of the next coarser level, a list of ends of
// segments; behind these, 8-byte aligned, masks of the halves and a row of bytes.
constexpr size_t half_values(size_t w, size_t h) { return half_stride((w + 1) / 2) * h + kBlock; }
constexpr size_t masks_begin(size_t w, size_t h) {
  return (wavelet_values(w, h) + 2 * half_values(w, h) + ((w + 1) / 2) * ((h + 1) / 2) + w * h + 1) / 2 * 2;
}
constexpr size_t wavelet_scratch(size_t w, size_t h) {
  return masks_begin(w, h) + 4 * mask_words((w + 1) / 2) * (h + 2 * kMaskRows) + half_stride((w + 1) / 2) / 2;
}

inline float dequantise(int32_t q, float step) {
  return float(q) * (q == 1 || q == -1 ? kReconstructedOne * step : step);
}

}  // namespace relief
