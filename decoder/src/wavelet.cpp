#include "wavelet.h"

#include <string.h>

#include <initializer_list>

namespace relief {

void lift_even(float* low, const float* high, int begin, int end, float factor, bool extend) {
  best_leaves().lift_even(low, high, begin, end, factor, extend);
}

void lift_odd(const float* low, float* high, int begin, int end, float factor, bool extend) {
  best_leaves().lift_odd(low, high, begin, end, factor, extend);
}

void build_masks(const Pyramid& p, uint8_t* m, uint8_t* scratch, const Leaves& leaves) {
  for (int l = 0; l < kLevels; l++) {
    const Band& in = p.low[l];
    const uint32_t lw = (in.width + 1) / 2, hw = in.width / 2, h = in.height;
    uint8_t *const lo = scratch, *const hi = scratch + size_t(lw) * (h + 2);
    for (uint32_t y = 0; y < h; y++)
      leaves.split_mask(m + in.at(0, y), lo + size_t(y) * lw, hi + size_t(y) * hw, in.width);
    memset(lo + size_t(h) * lw, 0, 2 * lw);
    memset(hi + size_t(h) * hw, 0, 2 * hw);
    auto columns = [&](const uint8_t* s, uint32_t w, const Band& even, const Band& odd) {
      for (uint32_t y = 0; y < even.height; y++) {
        const uint8_t *a = s + size_t(2 * y) * w, *b = a + w, *c = b + w;
        uint8_t* t = m + even.at(0, y);
        for (uint32_t x = 0; x < w; x++) t[x] = a[x] | (b[x] & (c[x] ^ 1));
      }
      for (uint32_t y = 0; y < odd.height; y++) {
        const uint8_t *a = s + size_t(2 * y) * w, *b = a + w, *c = b + w;
        uint8_t* t = m + odd.at(0, y);
        for (uint32_t x = 0; x < w; x++) t[x] = b[x] & (a[x] | c[x]);
      }
    };
    columns(lo, lw, p.low[l + 1], p.high[l][1]);
    columns(hi, hw, p.high[l][0], p.high[l][2]);
  }
}

namespace {

// Rows of zeros above and below the masks of a half, so that lifting may look three rows away.
constexpr uint32_t kMaskRows = 3;

// One half (low or high columns) of a level: `height` rows of `width` samples, `stride` apart, and its mask.
struct Half {
  uint32_t width, stride, height;
  float* value;
  uint8_t* mask;  // row 0; kMaskRows rows of zeros around
};

// Where the samples of a half come from: its low rows (values or quantised) and its high rows.
struct Source {
  const float* low_values;  // dense rows, or null: the quantised plane `low`
  const Band *low, *high;
  float low_step, high_step;
};

// Fills the rows of a half with scaled coefficients, even rows from the low band, odd rows from the high one.
void load_rows(const Leaves& leaves, const Half& half, const Source& s, const int32_t* q) {
  const uint32_t w = half.width;
  for (uint32_t y = 0; y < half.height; y += 2) {
    float* const even = half.value + size_t(y) * half.stride;
    float* const odd = y + 1 < half.height ? even + half.stride : nullptr;
    const uint32_t k = y / 2;
    if (s.low_values)
      memcpy(even, s.low_values + size_t(k) * w, w * sizeof(float));
    else
      leaves.dequantise(q + s.low->at(0, k), s.low_step, even, w);
    if (odd) leaves.dequantise(q + s.high->at(0, k), s.high_step, odd, w);
    leaves.scale_rows(even, odd, half.mask + size_t(y) * half.stride, half.stride, half.stride);
  }
}

// One lifting step down the columns of a half, on the rows of the given parity.
void lift_rows(const Leaves& leaves, const Half& half, uint32_t parity, float factor, bool extend) {
  const uint32_t w = half.stride, h = half.height;
  for (uint32_t y = parity; y < h; y += 2) {
    float* const v = half.value + size_t(y) * w;
    const float *up = y >= 1 ? v - w : v, *down = y + 1 < h ? v + w : v;
    const float *up3 = y >= 3 ? v - 3 * size_t(w) : v, *down3 = y + 3 < h ? v + 3 * size_t(w) : v;
    leaves.lift_row({v, up, down, up3, down3, half.mask + size_t(y) * w, ptrdiff_t(w)}, factor, extend, w);
  }
}

void inverse_columns(const Leaves& leaves, const Half& half, const Source& source, const int32_t* q) {
  load_rows(leaves, half, source, q);
  lift_rows(leaves, half, 0, -kLift[3], false);
  lift_rows(leaves, half, 1, -kLift[2], true);
  lift_rows(leaves, half, 0, -kLift[1], true);
  lift_rows(leaves, half, 1, -kLift[0], true);
}

// Masks of the two halves of a level, with rows of zeros around.
void half_masks(const Leaves& leaves, const Band& in, const uint8_t* m, const Half& low, const Half& high) {
  for (const Half* half : {&low, &high}) {
    const size_t around = size_t(kMaskRows) * half->stride;
    memset(half->mask - around, 0, 2 * around + size_t(half->height) * half->stride);
  }
  for (uint32_t y = 0; y < in.height; y++)
    leaves.split_mask(m + in.at(0, y), low.mask + size_t(y) * low.stride, high.mask + size_t(y) * high.stride,
                      in.width);
}

}  // namespace

const float* inverse_wavelet(const Pyramid& p, const int32_t* q, const uint8_t* m, float step, float* scratch,
                             const Leaves& leaves, int level) {
  const uint32_t w0 = p.low[0].width, h0 = p.low[0].height;
  const size_t most = half_stride((w0 + 1) / 2);
  float* const out = scratch + kMargin;                                  // w0 * h0
  float* const lows = scratch + wavelet_values(size_t(w0), size_t(h0));  // the low half
  float* const highs = lows + most * h0;                                 // the high half
  float* const coarser = highs + most * h0;                              // what the level before gave
  uint8_t* const masks = reinterpret_cast<uint8_t*>(coarser + size_t((w0 + 1) / 2) * ((h0 + 1) / 2));
  for (int l = kLevels - 1; l >= level; l--) {
    const Band& in = p.low[l];
    const uint32_t lw = (in.width + 1) / 2, hw = in.width / 2, h = in.height;
    const uint32_t ls = uint32_t(half_stride(lw)), hs = uint32_t(half_stride(hw));
    const Half low = {lw, ls, h, lows, masks + size_t(kMaskRows) * ls};
    const Half high = {hw, hs, h, highs, low.mask + size_t(h + kMaskRows) * ls + size_t(kMaskRows) * hs};
    half_masks(leaves, in, m, low, high);
    const float s_hl = step * band_step(l, 0), s_hh = step * band_step(l, 2);
    const bool first = l == kLevels - 1;
    inverse_columns(leaves, low, {first ? nullptr : coarser, &p.low[l + 1], &p.high[l][1], step, s_hl}, q);
    if (hw) inverse_columns(leaves, high, {nullptr, &p.high[l][0], &p.high[l][2], s_hl, s_hh}, q);
    float* const target = l == level ? out : coarser;
    for (uint32_t y = 0; y < h; y++)
      leaves.inverse_row(m + in.at(0, y), in.width, lows + size_t(y) * ls, highs + size_t(y) * hs,
                         target + size_t(y) * in.width);
  }
  if (level > 0) {  // a level's low band is sqrt(2) times the average, each way
    const size_t n = size_t(p.low[level].width) * p.low[level].height;
    const float share = 1.0f / float(1 << level);
    for (size_t i = 0; i < n; i++) out[i] *= share;
  }
  return out;
}

}  // namespace relief
