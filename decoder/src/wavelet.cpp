#include "wavelet.h"

#include <string.h>

#include "lines.h"
#include "runs.h"

namespace relief {

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

constexpr uint64_t kEvenBits = 0x5555555555555555u;

// Pixels of a row, 64 a word.
void pack_row(const uint8_t* m, uint32_t width, uint64_t* bits) {
  for (uint32_t x = 0; x < width; x += 8) {
    if (x % 64 == 0) bits[x / 64] = 0;
    bits[x / 64] |= uint64_t(pack_pixels(m + x)) << (x % 64);
  }
  if (width % 64) bits[width / 64] &= (uint64_t(1) << width % 64) - 1;
}

struct WaveletScratch {
  float* out;
  float *low, *high;  // the halves
  float* coarser;     // what the level before gave
  EndLists ends;      // from begin to end, empty
  uint8_t* masks;     // of a row of both halves by bytes, then of the halves
};

WaveletScratch lay_out(uint32_t w, uint32_t h, float* scratch) {
  const size_t half = half_values(w, h), lw = (w + 1) / 2, lh = (h + 1) / 2;
  WaveletScratch s;
  s.out = scratch + kMargin;
  s.masks = reinterpret_cast<uint8_t*>(scratch + masks_begin(w, h));
  s.low = scratch + wavelet_values(w, h);
  s.high = s.low + half;
  s.coarser = s.high + half;
  s.ends.even = reinterpret_cast<uint32_t*>(s.coarser + lw * lh);
  s.ends.odd = s.ends.even + size_t(w) * h;
  return s;
}

// One half (low or high columns) of a level: `height` rows of `width` samples, `stride` apart, and its mask,
// `words` a row, with kMaskRows rows of zeros around.
struct Half {
  uint32_t width, height, stride, words;
  float* value;
  uint64_t* mask;
};

// Where the samples of a half come from: its low rows (values or quantised) and its high rows.
struct Source {
  const float* low_values;  // dense rows, or null: the quantised plane `low`
  const Band *low, *high;
  float low_step, high_step;
};

// Fills the rows of a half with coefficients, even rows from the low band, odd rows from the high one.
void load_rows(const Leaves& leaves, const Half& half, const Source& s, const int32_t* q) {
  for (uint32_t y = 0; y < half.height; y++) {
    float* const row = half.value + size_t(y) * half.stride;
    const uint32_t k = y / 2;
    const bool odd = y % 2;
    if (!odd && s.low_values)
      memcpy(row, s.low_values + size_t(k) * half.width, half.width * sizeof(float));
    else
      leaves.dequantise(q + (odd ? s.high : s.low)->at(0, k), odd ? s.high_step : s.low_step, row,
                        half.width);
    for (uint32_t x = half.width; x < half.stride; x++) row[x] = 0;
  }
}

void inverse_columns(const Leaves& leaves, const Half& half, const EndLists& empty, float* kept) {
  EndLists ends = empty;
  const uint64_t* m = half.mask;
  const ptrdiff_t w = half.words;
  for (uint32_t y = 0; y < half.height; y++)
    for (uint32_t i = 0; i < half.words; i++, m++) {
      ends.add({m[-3 * w], m[-2 * w], m[-w], m[0], m[w], m[2 * w], m[3 * w]},
               (y & ~1u) * half.stride + 64 * i, 0, uint64_t(y & 1) - 1);
    }
  const Lines lines = {half.value, half.value + half.stride, half.height, half.stride,
                       2 * ptrdiff_t(half.stride)};
  inverse_lines(leaves, lines, empty, ends, kept);
}

// m: mask of the joined rows. bits: room for a row of it
void inverse_rows(const Leaves& leaves, const Band& in, const uint8_t* m, const Half& low, const Half& high,
                  const EndLists& empty, uint64_t* bits, float* kept) {
  EndLists ends = empty;
  const uint32_t words = uint32_t(mask_words(in.width));
  bits[0] = bits[words + 1] = 0;
  for (uint32_t y = 0; y < in.height; y++) {
    pack_row(m + in.at(0, y), in.width, bits + 1);
    for (uint32_t i = 0; i < words; i++) {
      const uint64_t b = bits[i], h = bits[i + 1], a = bits[i + 2];
      ends.add({h << 3 | b >> 61, h << 2 | b >> 62, h << 1 | b >> 63, h, h >> 1 | a << 63, h >> 2 | a << 62,
                h >> 3 | a << 61},
               y * low.stride + 32 * i, 1, kEvenBits);
    }
  }
  inverse_lines(leaves, {low.value, high.value, 2, low.stride * in.height, 1}, empty, ends, kept);
}

// Masks of the two halves of a level. row: room for a row of both, `stride` each
void half_masks(const Leaves& leaves, const Band& in, const uint8_t* m, const Half& low, const Half& high,
                uint8_t* row) {
  for (uint32_t y = 0; y < in.height; y++) {
    leaves.split_mask(m + in.at(0, y), row, row + low.stride, in.width);
    pack_row(row, low.width, low.mask + size_t(y) * low.words);
    pack_row(row + low.stride, high.width, high.mask + size_t(y) * high.words);
  }
}

}  // namespace

const float* inverse_wavelet(const Pyramid& p, const int32_t* q, const uint8_t* m, float step, float* scratch,
                             const Leaves& leaves, int level) {
  const uint32_t w0 = p.low[0].width, h0 = p.low[0].height;
  const WaveletScratch s = lay_out(w0, h0, scratch);
  for (int l = kLevels - 1; l >= level; l--) {
    const Band& in = p.low[l];
    const uint32_t lw = (in.width + 1) / 2, hw = in.width / 2, h = in.height;
    const uint32_t stride = uint32_t(half_stride(lw)), words = uint32_t(mask_words(lw));
    const size_t mask_size = size_t(words) * (h + 2 * kMaskRows);
    uint8_t* const row = s.masks;
    memset(row, 0, 2 * stride + 2 * mask_size * sizeof(uint64_t));
    uint64_t* const masks = reinterpret_cast<uint64_t*>(row + 2 * stride) + kMaskRows * words;
    const Half low = {lw, h, stride, words, s.low, masks},
               high = {hw, h, stride, words, s.high, masks + mask_size};
    half_masks(leaves, in, m, low, high, row);
    const float s_hl = step * band_step(l, 0), s_hh = step * band_step(l, 2) * kDetailScale;
    const float* const coarser = l == kLevels - 1 ? nullptr : s.coarser;
    load_rows(leaves, low, {coarser, &p.low[l + 1], &p.high[l][1], step * kCoarseScale, s_hl}, q);
    inverse_columns(leaves, low, s.ends, s.out);
    load_rows(leaves, high, {nullptr, &p.high[l][0], &p.high[l][2], s_hl, s_hh}, q);
    inverse_columns(leaves, high, s.ends, s.out);
    inverse_rows(leaves, in, m, low, high, s.ends, reinterpret_cast<uint64_t*>(row), s.out);
    float* const target = l == level ? s.out : s.coarser;
    for (uint32_t y = 0; y < h; y++)
      leaves.join_row(low.value + size_t(y) * stride, high.value + size_t(y) * stride,
                      target + size_t(y) * in.width, in.width);
    // the low band of the level that is decoded is sqrt(2) times the average, each way
    if (l > 0) leaves.scale(target, l > level ? kCoarseScale : 1.0f / float(1 << level), in.width * h);
  }
  return s.out;
}

}  // namespace relief
