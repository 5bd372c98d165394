#include "wavelet.h"

#include <string.h>

namespace relief {

void lift_even(float* low, const float* high, int begin, int end, float factor, bool extend) {
  if (end - begin < 2) return;
  int first = (begin + 1) / 2, last = (end - 1) / 2;  // even samples 2 * first .. 2 * last
  if (2 * first == begin) {                           // no left neighbour
    const float r = high[first];
    const float l = extend && begin + 3 < end ? r + (r - high[first + 1]) : r;
    low[first] += factor * (l + r);
    first++;
  }
  if (2 * last == end - 1 && last >= first) {  // no right neighbour
    const float l = high[last - 1];
    const float r = extend && end - 1 - 3 >= begin ? l + (l - high[last - 2]) : l;
    low[last] += factor * (l + r);
    last--;
  }
  for (int i = first; i <= last; i++) low[i] += factor * (high[i - 1] + high[i]);
}

void lift_odd(const float* low, float* high, int begin, int end, float factor, bool extend) {
  if (end - begin < 2) return;
  int first = begin / 2, last = end / 2 - 1;  // odd samples 2 * first + 1 .. 2 * last + 1
  if (2 * first + 1 == begin) {
    const float r = low[first + 1];
    const float l = extend && begin + 3 < end ? r + (r - low[first + 2]) : r;
    high[first] += factor * (l + r);
    first++;
  }
  if (2 * last + 1 == end - 1 && last >= first) {
    const float l = low[last];
    const float r = extend && end - 1 - 3 >= begin ? l + (l - low[last - 1]) : l;
    high[last] += factor * (l + r);
    last--;
  }
  for (int i = first; i <= last; i++) high[i] += factor * (low[i] + low[i + 1]);
}

void build_masks(const Pyramid& p, uint8_t* m, uint8_t* scratch) {
  for (int l = 0; l < kLevels; l++) {
    const Band& in = p.low[l];
    const uint32_t lw = (in.width + 1) / 2, hw = in.width / 2, h = in.height;
    uint8_t *const lo = scratch, *const hi = scratch + size_t(lw) * (h + 2);
    for (uint32_t y = 0; y < h; y++) {
      const uint8_t* s = m + in.at(0, y);
      for (uint32_t x = 0; x < lw; x++) lo[y * lw + x] = s[2 * x] | (s[2 * x + 1] & !s[2 * x + 2]);
      for (uint32_t x = 0; x < hw; x++) hi[y * hw + x] = s[2 * x + 1] & (s[2 * x] | s[2 * x + 2]);
    }
    memset(lo + size_t(h) * lw, 0, 2 * lw);
    memset(hi + size_t(h) * hw, 0, 2 * hw);
    auto columns = [&](const uint8_t* s, uint32_t w, const Band& even, const Band& odd) {
      for (uint32_t y = 0; y < even.height; y++) {
        const uint8_t *a = s + size_t(2 * y) * w, *b = a + w, *c = b + w;
        uint8_t* t = m + even.at(0, y);
        for (uint32_t x = 0; x < w; x++) t[x] = a[x] | (b[x] & !c[x]);
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

// One half (low or high columns) of a level: `height` rows of `width` samples, and its mask.
struct Half {
  uint32_t width, height;
  float* value;
  const uint8_t* mask;  // row 0; kMaskRows rows of zeros around
};

// Where the samples of a half come from: its low rows (values or quantised) and its high rows.
struct Source {
  const float* low_values;  // dense rows, or null: the quantised plane `low`
  const Band *low, *high;
  float low_step, high_step;
};

// Fills the rows of a half with scaled coefficients, even rows from the low band, odd rows from the high one.
void load_rows(const Half& half, const Source& s, const int32_t* q) {
  const uint32_t w = half.width;
  for (uint32_t y = 0; y < half.height; y++) {
    const uint8_t *here = half.mask + size_t(y) * w, *up = here - w, *down = here + w;
    float* out = half.value + size_t(y) * w;
    const uint32_t k = y / 2;
    const float* values = s.low_values ? s.low_values + size_t(k) * w : nullptr;
    const int32_t* low = q + s.low->at(0, k);
    const int32_t* high = s.high->height > k ? q + s.high->at(0, k) : nullptr;
    for (uint32_t x = 0; x < w; x++) {
      const bool single = !(up[x] | down[x]);
      if (y & 1 && !single) {
        out[x] = here[x] ? dequantise(high[x], s.high_step) * kLowScale : 0.0f;
      } else {
        const float v = values ? values[x] : dequantise(low[x], s.low_step);
        out[x] = here[x] ? v * (single ? kSqrtHalf : kHighScale) : 0.0f;
      }
    }
  }
}

// One lifting step down the columns of a half, on the rows of the given parity.
void lift_rows(const Half& half, uint32_t parity, float factor, bool extend) {
  const ptrdiff_t w = half.width;
  for (uint32_t y = parity; y < half.height; y += 2) {
    const uint8_t* m = half.mask + ptrdiff_t(y) * w;
    float* v = half.value + ptrdiff_t(y) * w;
    auto at_end = [&](ptrdiff_t x) {  // a sample with a neighbour missing
      if (!m[x] || !(m[x - w] | m[x + w])) return;
      const ptrdiff_t s = m[x - w] ? -w : w;
      if (m[x - w] && m[x + w]) {
        v[x] += factor * (v[x - w] + v[x + w]);
        return;
      }
      const float a = v[x + s];
      const float b = extend && m[x + 2 * s] && m[x + 3 * s] ? a + (a - v[x + 3 * s]) : a;
      v[x] += factor * (b + a);
    };
    ptrdiff_t x = 0;
    for (; x + 8 <= w; x += 8) {
      uint64_t here, up, down;
      __builtin_memcpy(&here, m + x, 8);
      __builtin_memcpy(&up, m + x - w, 8);
      __builtin_memcpy(&down, m + x + w, 8);
      if ((here & up & down) == 0x0101010101010101u) {
        const float *a = v + x - w, *b = v + x + w;
        float t[8];
        for (int i = 0; i < 8; i++) t[i] = v[x + i] + factor * (a[i] + b[i]);
        for (int i = 0; i < 8; i++) v[x + i] = t[i];
      } else if (here) {
        for (int i = 0; i < 8; i++) at_end(x + i);
      }
    }
    for (; x < w; x++) at_end(x);
  }
}

void inverse_columns(const Half& half, const Source& source, const int32_t* q) {
  load_rows(half, source, q);
  lift_rows(half, 0, -kLift[3], false);
  lift_rows(half, 1, -kLift[2], true);
  lift_rows(half, 0, -kLift[1], true);
  lift_rows(half, 1, -kLift[0], true);
}

// Joins a row's low and high halves (both are overwritten) into `out`, segment by segment of the mask `m`.
void inverse_row(const uint8_t* m, uint32_t width, float* low, float* high, float* out) {
  for (uint32_t x = 0; x < width;) {
    if (!m[x]) {
      x++;
      continue;
    }
    const int begin = int(x);
    while (x < width && m[x]) x++;
    const int end = int(x);
    if (end - begin == 1) {
      out[begin] = low[begin / 2] * kSqrtHalf;
      continue;
    }
    for (int k = (begin + 1) / 2; 2 * k < end; k++) low[k] *= kHighScale;
    for (int k = begin / 2; 2 * k + 1 < end; k++) high[k] *= kLowScale;
    lift_even(low, high, begin, end, -kLift[3], false);
    lift_odd(low, high, begin, end, -kLift[2], true);
    lift_even(low, high, begin, end, -kLift[1], true);
    lift_odd(low, high, begin, end, -kLift[0], true);
    int g = begin;
    if (g & 1) out[g] = high[g / 2], g++;
    for (; g + 1 < end; g += 2) out[g] = low[g / 2], out[g + 1] = high[g / 2];
    if (g < end) out[g] = low[g / 2];
  }
}

// Masks of the two halves of a level, with rows of zeros around.
void half_masks(const Band& in, const uint8_t* m, uint8_t* lo, uint8_t* hi) {
  const uint32_t lw = (in.width + 1) / 2, hw = in.width / 2;
  memset(lo - size_t(kMaskRows) * lw, 0, size_t(kMaskRows) * lw);
  memset(hi - size_t(kMaskRows) * hw, 0, size_t(kMaskRows) * hw);
  for (uint32_t y = 0; y < in.height; y++) {
    const uint8_t* s = m + in.at(0, y);
    for (uint32_t x = 0; x < lw; x++) lo[size_t(y) * lw + x] = s[2 * x] | (s[2 * x + 1] & !s[2 * x + 2]);
    for (uint32_t x = 0; x < hw; x++) hi[size_t(y) * hw + x] = s[2 * x + 1] & (s[2 * x] | s[2 * x + 2]);
  }
  memset(lo + size_t(in.height) * lw, 0, size_t(kMaskRows) * lw);
  memset(hi + size_t(in.height) * hw, 0, size_t(kMaskRows) * hw);
}

}  // namespace

const float* inverse_wavelet(const Pyramid& p, const int32_t* q, const uint8_t* m, float step,
                             float* scratch) {
  const uint32_t w0 = p.low[0].width, h0 = p.low[0].height;
  float* const out = scratch;                                // w0 * h0
  float* const lows = out + size_t(w0) * h0;                 // the low half
  float* const highs = lows + size_t((w0 + 1) / 2) * h0;     // the high half
  float* const coarser = highs + size_t((w0 + 1) / 2) * h0;  // what the level before gave
  uint8_t* const masks = reinterpret_cast<uint8_t*>(coarser + size_t((w0 + 1) / 2) * ((h0 + 1) / 2));
  for (int l = kLevels - 1; l >= 0; l--) {
    const Band& in = p.low[l];
    const uint32_t lw = (in.width + 1) / 2, hw = in.width / 2, h = in.height;
    uint8_t* const lo = masks + size_t(kMaskRows) * lw;
    uint8_t* const hi = lo + size_t(h + kMaskRows) * lw + size_t(kMaskRows) * hw;
    half_masks(in, m, lo, hi);
    const float s_hl = step * band_step(l, 0), s_hh = step * band_step(l, 2);
    const bool first = l == kLevels - 1;
    inverse_columns({lw, h, lows, lo}, {first ? nullptr : coarser, &p.low[l + 1], &p.high[l][1], step, s_hl},
                    q);
    if (hw) inverse_columns({hw, h, highs, hi}, {nullptr, &p.high[l][0], &p.high[l][2], s_hl, s_hh}, q);
    float* const target = l == 0 ? out : coarser;
    for (uint32_t y = 0; y < h; y++)
      inverse_row(m + in.at(0, y), in.width, lows + size_t(y) * lw, highs + size_t(y) * hw,
                  target + size_t(y) * in.width);
  }
  return out;
}

}  // namespace relief
