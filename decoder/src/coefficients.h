// The `subband` coefficient coder: quantised wavelet coefficients band by band, each bit by two models: one
// in a rich context made of coded neighbours, parent and sibling bands, one by the nearest magnitudes; mixed.
// Quantisation is trellis-coded. Shared with the encoder.
#pragma once
#include "first_guesses.h"
#include "format.h"
#include "leaves.h"
#include "mixing.h"

namespace relief {

constexpr int kUnary = 15;       // magnitudes from here on have an exponential-Golomb tail
constexpr int kScales = 3;       // the two finest levels and all coarser ones have models of their own
constexpr int kGreaterSets = 5;  // sets of mixing weights for the steps of a magnitude

// Trellis-coded quantisation (Marcellin and Fischer 1990): two quantisers have twice the step, so together
// they have every multiple of it. A magnitude k is worth 2k steps where the state is even, 2k - 1 where it is
// odd, nothing if k is 0; the parity of k leads to the next state, by Ungerboeck's code of 32 states. A band
// begins with state 0. Part of the format.
constexpr int kTrellisStates = 32;
constexpr int quantiser_of(int state) { return state & 1; }
constexpr int next_state(int state, int32_t k) { return state >> 1 ^ (state & 1) * 18 ^ (k & 1) * 4; }

inline int32_t magnitude(int32_t v) { return v < 0 ? -v : v; }

// The magnitude k that is coded for q steps: of either quantiser.
inline int32_t coded_magnitude(int32_t q) { return (magnitude(q) + 1) >> 1; }

// What a coefficient's expected magnitude is made of: weights of the coded magnitudes around it, fitted on
// scans by hill climbing on the bits. Part of the format.
struct ActivityWeights {
  uint8_t W, N, NW, NE, WW, NN;                // coded neighbours in the band
  uint8_t parent, parent_across, parent_down;  // the same band, a level coarser, and the neighbours there
  struct {
    uint8_t here, across, down;
  } sibling[2];  // the bands of this level that are coded already: HL, LH
};
constexpr ActivityWeights kActivityWeights[3] = {{52, 50, 8, 30, 4, 12, 6, 1, 5, {}},
                                                 {58, 28, 6, 18, 12, 0, 5, 3, 2, {{12, 8, 8}, {}}},
                                                 {18, 3, 9, 14, 0, 0, 4, 1, 1, {{10, 2, 8}, {6, 5, 2}}}};
constexpr int kActivityShift = 2;
constexpr int kEdgeFactor = 205, kEdgeShift = 6;  // coefficients at the mask's edge are larger

// Class of a weighted sum: two an octave.
constexpr int activity_class(uint32_t e) {
  if (e < 2) return int(e);
  const int octave = 31 - __builtin_clz(e), c = 2 * octave + int(e >> (octave - 1) & 1);
  return c < kActivities ? c : kActivities - 1;
}

static_assert(activity_class(kSumCap >> kActivityShift) == kActivities - 1,
              "sums are cut where it makes no difference");

// What changes from bit to bit.
struct LearnedModels {
  // each bit has two models, mixed: one by activity, one by the nearest magnitudes
  Model zero[kActivities][3][kScales][2][2];  // by activity, band type, scale, mask edge, quantiser
  Model greater[kActivities][kScales][kUnary + 1];
  Model zero_near[256][3][2];  // by nearest magnitudes, band type, quantiser
  Model greater_near[64][3][kUnary + 1];
  int32_t weight[kActivities][2 + kGreaterSets][2];  // of zero, by quantiser, then of greater
  // bits of one model
  Model sign[3][9];
  Model tail[2][kGolombModels];  // by whether the activity is the highest
  Model low_zero[2], low[2][kGolombModels];
};

struct CoefficientModels : LearnedModels {
  Logistic logistic;
  uint8_t class_of_sum[2][kSumCap + 1];  // activity, by mask edge and the sum of an activity's terms

  RELIEF_COLD void init() {
    logistic.init();
    for (uint32_t e = 0; e <= kSumCap; e++) {
      class_of_sum[0][e] = uint8_t(activity_class(e >> kActivityShift));
      class_of_sum[1][e] = uint8_t(activity_class((e * kEdgeFactor >> kEdgeShift) >> kActivityShift));
    }
    for (int a = 0; a < kActivities; a++) guess_by_activity(a);
    for (int t = 0; t < 3; t++) {
      for (uint32_t near = 0; near < 256; near++) guess_near(t, near);
      for (int i = 0; i < 9; i++) sign[t][i] = model_of(kFirstSign[t][i] * 256u, kFirstSignCount);
    }
    for (int i = 0; i < 2; i++) {
      guess_golomb(low[i], kFirstLow);
      guess_golomb(tail[i], kFirstTail[i]);
      low_zero[i] = model_of(kFirstLow[0] * 256u, kFirstGolombCount);
    }
  }

 private:
  // A probability of 16 bits, moved in the logistic domain by 1/32 a step.
  RELIEF_COLD uint32_t moved(uint32_t p16, int steps) const {
    return uint32_t(Logistic::squash(logistic.stretch[p16 >> 4] + 8 * steps)) << 4;
  }
  RELIEF_COLD static uint32_t first_greater(int activity, int k) {
    return kFirstGreater[activity][k < 3 ? k - 1 : 2] * 256u;
  }

  RELIEF_COLD void guess_by_activity(int a) {
    for (int t = 0; t < 3; t++)
      for (int scale = 0; scale < kScales; scale++)
        for (int edge = 0; edge < 2; edge++)
          for (int i = 0; i < 2; i++)
            zero[a][t][scale][edge][i] =
                model_of(moved(kFirstNonzero[i][a], kNonzeroMove[i][t][scale][edge]), kFirstCount);
    for (int scale = 0; scale < kScales; scale++)
      for (int k = 1; k < kUnary; k++)
        greater[a][scale][k] = model_of(moved(first_greater(a, k), kGreaterMove[scale]), kFirstCount);
    for (auto& set : weight[a]) set[0] = 52000, set[1] = 18000;  // 0.79 and 0.27
  }

  // By the activity that the nearest magnitudes would make, had they no more than what is kept of them. Most
  // that are cut short are greater, and bands coded before have their share, too: for the first bit the class
  // is higher.
  RELIEF_COLD void guess_near(int t, uint32_t near) {
    const ActivityWeights& k = kActivityWeights[t];
    const uint32_t e = k.W * (near & 3) + k.N * (near >> 2 & 3) + k.NW * (near >> 4 & 1) +
                       k.NE * (near >> 5 & 1) + (k.WW + k.NN) * (near >> 6) / 2;
    for (int i = 0; i < 2; i++)
      zero_near[near][t][i] =
          model_of(kFirstNonzero[i][activity_class(6 * e >> kActivityShift)], kFirstNearCount);
    for (int i = 1; i < kUnary && near < 64; i++)
      greater_near[near][t][i] = model_of(first_greater(activity_class(e), i), kFirstNearCount);
  }

  RELIEF_COLD static void guess_golomb(Model* m, const uint8_t (&prefix)[14]) {
    for (int i = 0; i < kGolombModels; i++)
      m[i] = model_of((i < 14 ? prefix[i] : i < 20 ? 40 : 100) * 256u, kFirstGolombCount);
  }
};

// The contexts of one coefficient, but for its sign.
struct Context {
  int activity;
  int near;  // the nearest magnitudes, cut short: bits 0-5 W, N, NW, NE; bits 6-7 those beyond
  bool edge;
};

inline int sign_context(const int32_t* c, ptrdiff_t stride) {
  return 3 * ((c[-stride] > 0) - (c[-stride] < 0)) + (c[-1] > 0) - (c[-1] < 0) + 4;
}

// Coded magnitudes around a coefficient that are nearest to it.
struct Nearest {
  uint32_t W, N, NW, NE, WW, NN;
};

// A share of a context: of those bands that are coded before the coefficient's own, weighted.
inline uint32_t weigh_bands(const Pyramid& p, const int32_t* q, int level, int type, uint32_t x, uint32_t y) {
  const ActivityWeights& k = kActivityWeights[type];
  auto around = [](const int32_t* t, ptrdiff_t s, uint32_t here, uint32_t across, uint32_t down) {
    auto at = [t](ptrdiff_t i) { return uint32_t(coded_magnitude(t[i])); };
    return here * at(0) + across * (at(-1) + at(1)) + down * (at(-s) + at(s));
  };
  uint32_t e = 0;
  if (level + 1 < kLevels) {
    const Band& up = p.high[level + 1][type];
    const uint32_t px = x / 2 < up.width ? x / 2 : up.width - 1,
                   py = y / 2 < up.height ? y / 2 : up.height - 1;
    if (up.width && up.height)
      e += around(q + up.at(px, py), up.stride, k.parent, k.parent_across, k.parent_down);
  }
  for (int i = 0; i < type; i++) {
    const Band& sib = p.high[level][i];
    if (x < sib.width && y < sib.height)
      e += around(q + sib.at(x, y), sib.stride, k.sibling[i].here, k.sibling[i].across, k.sibling[i].down);
  }
  return e;
}

// Whether a coefficient, of the mask's plane at `in`, is at the mask's edge.
inline bool at_edge(const uint8_t* in, ptrdiff_t stride) {
  return in[-1] + in[1] + in[-stride] + in[stride] + in[-stride + 1] < 5;
}

// The context of a coefficient of band `type`. bands: of weigh_bands.
inline Context context_of(int type, const Nearest& n, uint32_t bands, bool edge) {
  const ActivityWeights& k = kActivityWeights[type];
  // hostile magnitudes are 2^21 at most, about: sums of products fit
  uint32_t e = bands + k.W * n.W + k.N * n.N + k.NW * n.NW + k.NE * n.NE + k.WW * n.WW + k.NN * n.NN;
  constexpr uint32_t kMost = 1u << 22;  // all classes end far below
  if (e > kMost) e = kMost;
  if (edge) e = e * kEdgeFactor >> kEdgeShift;
  auto cut = [](uint32_t v, uint32_t most) { return int(v < most ? v : most); };
  Context r;
  r.activity = activity_class(e >> kActivityShift);
  r.near = cut(n.W, 3) | cut(n.N, 3) << 2 | cut(n.NW, 1) << 4 | cut(n.NE, 1) << 5 | cut(n.WW + n.NN, 3) << 6;
  r.edge = edge;
  return r;
}

// Gathers the context of the coefficient at (x, y) of band `type` at `level`. q: the patch's planes of
// quantised coefficients, m: of masks (same layout).
inline Context context_at(const Pyramid& p, const int32_t* q, const uint8_t* m, int level, int type,
                          uint32_t x, uint32_t y) {
  const Band& b = p.high[level][type];
  const ptrdiff_t s = b.stride;
  const int32_t* c = q + b.at(x, y);
  auto at = [c](ptrdiff_t i) { return uint32_t(coded_magnitude(c[i])); };
  return context_of(type, {at(-1), at(-s), at(-s - 1), at(-s + 1), at(-2), at(-2 * s)},
                    weigh_bands(p, q, level, type, x, y), at_edge(m + b.at(x, y), s));
}

// The models of one bit of a coefficient.
struct BitModels {
  Model* m[2];
  int32_t* weight;
};

inline int scale_of(int level) { return level < kScales ? level : kScales - 1; }

inline BitModels zero_models(CoefficientModels& models, const Context& c, int level, int type,
                             int quantiser) {
  return {{&models.zero[c.activity][type][scale_of(level)][c.edge][quantiser],
           &models.zero_near[c.near][type][quantiser]},
          models.weight[c.activity][quantiser]};
}

// Of the bit that tells whether the magnitude is greater than k.
inline BitModels greater_models(CoefficientModels& models, const Context& c, int level, int type, int k) {
  const int set = k < kGreaterSets ? k - 1 : kGreaterSets - 1;
  return {{&models.greater[c.activity][scale_of(level)][k], &models.greater_near[c.near & 63][type][k]},
          models.weight[c.activity][2 + set]};
}

// Where nothing around is coded, one model does: most coefficients are there.
template <class Coder>
RELIEF_INLINE int code_bit(Coder& coder, const Logistic& logistic, const Context& c, const BitModels& b,
                           int bit) {
  if (c.activity == 0) return code_bit<kSingleLimit>(coder, *b.m[0], bit);
  return code_mixed<2, kCoefficientLimit, 15>(coder, logistic, b.m, b.weight, bit);
}

// Codes one coefficient in its context, and leads the state on. Inlined, or else the coder's state would go
// through memory. sign_of: gives the context of its sign, if it has one
template <class Coder, class SignOf>
RELIEF_INLINE int32_t code_coefficient(Coder& coder, CoefficientModels& models, const Context& ctx, int level,
                                       int type, int& state, int32_t v, SignOf sign_of) {
  const int32_t mag = coded_magnitude(v);
  const int quantiser = quantiser_of(state);
  if (!code_bit(coder, models.logistic, ctx, zero_models(models, ctx, level, type, quantiser), mag > 0)) {
    state = next_state(state, 0);
    return 0;
  }
  const int negative = code_bit<kSingleLimit>(coder, models.sign[type][sign_of()], v < 0);
  int32_t k = 1;
  while (k < kUnary &&
         code_bit(coder, models.logistic, ctx, greater_models(models, ctx, level, type, k), mag > k))
    k++;
  if (k == kUnary) {
    k += int32_t(
        code_golomb_aside(coder, models.tail[ctx.activity == kActivities - 1], uint32_t(mag - kUnary)));
  }
  state = next_state(state, k);
  k = 2 * k - quantiser;
  return negative ? -k : k;
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
RELIEF_COLD bool code_low(Coder& coder, CoefficientModels& models, const Pyramid& p, int32_t* q,
                          const uint8_t* m) {
  const Band& b = p.low[kLevels];
  for (uint32_t y = 0; y < b.height; y++)
    for (uint32_t x = 0; x < b.width; x++) {
      const size_t i = b.at(x, y);
      if (!m[i]) continue;
      const int32_t predicted = predict_low(q + i, m + i, b.stride);
      const int c = m[i - 1] || m[i - b.stride];
      int32_t r = q[i] - predicted;
      const int32_t mag = magnitude(r);
      if (code_seldom<kSingleLimit>(coder, models.low_zero[c], mag > 0)) {
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
