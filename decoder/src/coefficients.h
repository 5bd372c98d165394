// The `subband` coefficient coder: quantised wavelet coefficients band by band, each with one rich context
// made of its coded neighbours, its parent and the sibling bands. Shared with the encoder.
#pragma once
#include "format.h"
#include "models.h"

namespace relief {

constexpr int kActivities = 16;  // classes of the expected magnitude
constexpr int kUnary = 15;       // magnitudes from here on have an exponential-Golomb tail

// Class of a weighted sum of neighbouring magnitudes: 0 for 0, then about logarithmic to the base 1.45. Part
// of the format.
struct ActivityTable {
  static constexpr int kSize = 256;
  uint8_t value[kSize];
  constexpr ActivityTable() : value() {
    constexpr int kFirst[kActivities] = {0, 1, 2, 3, 4, 5, 7, 10, 14, 20, 29, 42, 60, 87, 126, 182};
    for (int i = 0, k = 0; i < kSize; i++) {
      while (k + 1 < kActivities && i >= kFirst[k + 1]) k++;
      value[i] = uint8_t(k);
    }
  }
};
inline constexpr ActivityTable kActivity;

struct CoefficientModels {
  Model zero[kActivities][4][kLevels][2];  // by activity, band type, level, mask edge
  Model greater[kActivities][3][kUnary + 1];
  Model sign[3][9];
  Model tail[3][kGolombModels];
  Model low_zero[2], low[2][kGolombModels];
  void init() {
    for (Model* m = &zero[0][0][0][0]; m < &zero[0][0][0][0] + sizeof(zero) / sizeof(Model); m++)
      *m = kModelInit;
    for (Model* m = &greater[0][0][0]; m < &greater[0][0][0] + sizeof(greater) / sizeof(Model); m++)
      *m = kModelInit;
    for (auto& t : sign)
      for (Model& m : t) m = kModelInit;
    for (auto& t : tail)
      for (Model& m : t) m = kModelInit;
    for (auto& t : low)
      for (Model& m : t) m = kModelInit;
    low_zero[0] = low_zero[1] = kModelInit;
  }
};

inline int32_t magnitude(int32_t v) { return v < 0 ? -v : v; }

// The contexts of one coefficient.
struct Context {
  int activity;
  bool edge;
  int sign;
};

// Gathers the context of the coefficient at (x, y) of band `type` at `level`. q: the patch's planes of
// quantised coefficients, m: of masks (same layout).
inline Context context_at(const Pyramid& p, const int32_t* q, const uint8_t* m, int level, int type,
                          uint32_t x, uint32_t y) {
  const Band& b = p.high[level][type];
  const ptrdiff_t s = b.stride;
  const int32_t* c = q + b.at(x, y);
  const int32_t W = magnitude(c[-1]), N = magnitude(c[-s]), NW = magnitude(c[-s - 1]),
                NE = magnitude(c[-s + 1]);
  const int32_t WW = magnitude(c[-2]), NN = magnitude(c[-2 * s]);
  int32_t e;
  if (type == 2)
    e = 3 * (W + N) + 2 * (NW + NE) + WW + NN;
  else if (type == 0)
    e = 4 * N + 2 * W + 2 * (NW + NE) + WW + NN;  // HL: structures run down
  else
    e = 4 * W + 2 * N + 2 * (NW + NE) + WW + NN;
  e *= 2;
  if (level + 1 < kLevels) {  // the parent in the same band of the next coarser level, and its neighbours
    const Band& up = p.high[level + 1][type];
    const uint32_t px = x / 2 < up.width ? x / 2 : up.width - 1,
                   py = y / 2 < up.height ? y / 2 : up.height - 1;
    if (up.width && up.height) {
      const int32_t* t = q + up.at(px, py);
      const ptrdiff_t ts = up.stride;
      e += 3 * magnitude(t[0]) + magnitude(t[-1]) + magnitude(t[1]) + magnitude(t[-ts]) + magnitude(t[ts]);
    }
  }
  int32_t siblings = 0;
  for (int k = 0; k < type; k++) {  // the bands of this level that are coded already
    const Band& sib = p.high[level][k];
    if (x >= sib.width || y >= sib.height) continue;
    const int32_t* t = q + sib.at(x, y);
    const ptrdiff_t ts = sib.stride;
    siblings +=
        3 * magnitude(t[0]) + 2 * (magnitude(t[-1]) + magnitude(t[1]) + magnitude(t[-ts]) + magnitude(t[ts]));
  }
  e += type == 2 ? siblings / 2 : siblings;
  const uint8_t* k = m + b.at(x, y);
  Context r;
  r.edge = k[-1] + k[1] + k[-s] + k[s] + k[-s + 1] < 5;
  if (r.edge) e = e * 5 / 4;
  r.activity = kActivity.value[e < ActivityTable::kSize ? e : ActivityTable::kSize - 1];
  r.sign = 3 * ((c[-s] > 0) - (c[-s] < 0)) + (c[-1] > 0) - (c[-1] < 0) + 4;
  return r;
}

// Codes one coefficient in its context.
template <class Coder>
int32_t code_coefficient(Coder& coder, CoefficientModels& models, const Context& ctx, int level, int type,
                         int32_t v) {
  const int32_t mag = magnitude(v);
  if (!code_bit<kCoefficientLimit>(coder, models.zero[ctx.activity][type][level][ctx.edge], mag > 0))
    return 0;
  const int negative = code_bit<kCoefficientLimit>(coder, models.sign[type][ctx.sign], v < 0);
  int32_t k = 1;
  while (k < kUnary && code_bit<kCoefficientLimit>(coder, models.greater[ctx.activity][type][k], mag > k))
    k++;
  if (k == kUnary) k += int32_t(code_golomb(coder, models.tail[type], uint32_t(mag - kUnary)));
  return negative ? -k : k;
}

// Codes a band of a patch. Stops early and leaves the rest zero when a cut stream ends. Returns false then.
template <class Coder>
bool code_band(Coder& coder, CoefficientModels& models, const Pyramid& p, int32_t* q, const uint8_t* m,
               int level, int type) {
  const Band& b = p.high[level][type];
  for (uint32_t y = 0; y < b.height; y++) {
    const size_t row = b.at(0, y);
    for (uint32_t x = 0; x < b.width; x++) {
      if (!m[row + x]) continue;
      const Context ctx = context_at(p, q, m, level, type, x, y);
      q[row + x] = code_coefficient(coder, models, ctx, level, type, q[row + x]);
    }
    if constexpr (!Coder::kEncoding) {
      if (coder.exhausted()) {
        for (uint32_t x = 0; x < b.width; x++) q[row + x] = 0;
        return false;
      }
    }
  }
  return true;
}

// The prediction of a coefficient of the coarsest LL from its coded neighbours: a plane where there are
// three.
inline int32_t predict_low(const int32_t* c, const uint8_t* m, ptrdiff_t s) {
  const bool W = m[-1], N = m[-s], NW = m[-s - 1];
  if (W && N) return NW ? (3 * (c[-1] + c[-s]) - 2 * c[-s - 1]) / 4 : (c[-1] + c[-s]) / 2;
  if (W) return c[-1];
  if (N) return c[-s];
  if (m[-s + 1]) return c[-s + 1];
  return NW ? c[-s - 1] : 0;
}

// Codes the coarsest LL of a patch.
template <class Coder>
bool code_low(Coder& coder, CoefficientModels& models, const Pyramid& p, int32_t* q, const uint8_t* m) {
  const Band& b = p.low[kLevels];
  for (uint32_t y = 0; y < b.height; y++)
    for (uint32_t x = 0; x < b.width; x++) {
      const size_t i = b.at(x, y);
      if (!m[i]) continue;
      const int32_t predicted = predict_low(q + i, m + i, b.stride);
      const int c = m[i - 1] || m[i - b.stride];
      int32_t r = q[i] - predicted;
      const int32_t mag = magnitude(r);
      if (code_bit<kCoefficientLimit>(coder, models.low_zero[c], mag > 0)) {
        const int negative = coder.code(r < 0, 32768);
        const int32_t k = 1 + int32_t(code_golomb(coder, models.low[c], uint32_t(mag - 1)));
        r = negative ? -k : k;
      } else {
        r = 0;
      }
      if constexpr (!Coder::kEncoding) {
        if (coder.exhausted()) return false;
        // q = predicted + r stays within 2^28 so that hostile sums cannot overflow
        const int32_t v = predicted + r;
        q[i] = v > 1 << 26 ? 1 << 26 : v < -(1 << 26) ? -(1 << 26) : v;
      }
    }
  return true;
}

}  // namespace relief
