// Contexts of coefficients by spans of a row: all that is known before the row is coded comes from loops over
// the rows around. What context_at finds for one coefficient is the definition.
#pragma once
#include "coefficients.h"
#include "leaves.h"

namespace relief {

class SpanContext {
 public:
  static constexpr uint32_t kMost = 64;  // coefficients of a span
  static_assert(kMost % (2 * kSpanBlock) == 0);

  // For the n coefficients from (x, y) on of a band, x even. q, m: as for context_at.
  void gather(const Leaves& leaves, const Pyramid& p, const int32_t* q, const uint8_t* m, int level, int type,
              uint32_t x, uint32_t y, uint32_t n) {
    const ActivityWeights& k = kActivityWeights[type];
    const Band& b = p.high[level][type];
    const ptrdiff_t s = b.stride;
    const int32_t* c = q + b.at(x, y);
    uint16_t above[kMost + kSpanBlock], above2[kMost];
    leaves.magnitudes(c - s - 1, above, n + 2);
    leaves.magnitudes(c - 2 * s, above2, n);
    leaves.weigh_above(above + 1, above2, {k.N, k.NW, k.NE, k.NN}, sum_, near_, n);
    leaves.edges(m + b.at(x, y), s, edge_, n);
    if (level + 1 < kLevels) add_parent(leaves, p.high[level + 1][type], q, k, x / 2, y / 2, n);
    for (int i = 0; i < type; i++) {
      const Band& sibling = p.high[level][i];
      if (x >= sibling.width || y >= sibling.height) continue;
      const AroundWeights weights = {k.sibling[i].here, k.sibling[i].across, k.sibling[i].down};
      // a sibling is at most one coefficient narrower: that one has no share
      const uint32_t there = n < sibling.width - x ? n : sibling.width - x;
      const uint16_t beyond = sum_[there % kMost];
      add_around(leaves, q + sibling.at(x, y), sibling.stride, weights, sum_, there);
      if (there < n) sum_[there] = beyond;
    }
  }

  // The context of the i-th after the coded magnitudes W and WW before it in the row.
  Context at(uint32_t i, const CoefficientModels& models, const ActivityWeights& k, uint32_t W,
             uint32_t WW) const {
    Context r;
    r.edge = edge_[i];
    const uint32_t e = sum_[i] + k.W * W + k.WW * WW;
    r.activity = models.class_of_sum[r.edge][e < kSumCap ? e : kSumCap];
    const uint32_t near = near_[i], beyond = WW + (near >> 6);
    r.near = int((near & 63) | (W < 3 ? W : 3) | (beyond < 3 ? beyond : 3) << 6);
    return r;
  }

 private:
  static void add_around(const Leaves& leaves, const int32_t* t, ptrdiff_t stride, AroundWeights weights,
                         uint16_t* sum, uint32_t n) {
    uint16_t up[kMost], here[kMost + kSpanBlock], down[kMost];
    leaves.magnitudes(t - stride, up, n);
    leaves.magnitudes(t - 1, here, n + 2);
    leaves.magnitudes(t + stride, down, n);
    leaves.weigh_around(up, here + 1, down, weights, sum, n);
  }

  // The band of the coarser level from (x, y) on; beyond its ends its last row and column count again.
  void add_parent(const Leaves& leaves, const Band& up, const int32_t* q, const ActivityWeights& k,
                  uint32_t x, uint32_t y, uint32_t n) {
    if (!up.width || !up.height) return;
    if (x >= up.width) x = up.width - 1;
    if (y >= up.height) y = up.height - 1;
    const uint32_t half = (n + 1) / 2, there = half < up.width - x ? half : up.width - x;
    uint16_t sum[kMost / 2] = {};  // whole blocks of halves are half of a span's
    add_around(leaves, q + up.at(x, y), up.stride, {k.parent, k.parent_across, k.parent_down}, sum, there);
    for (uint32_t i = there; i < half; i++) sum[i] = sum[there - 1];
    leaves.add_doubled(sum, sum_, n);
  }

  uint16_t sum_[kMost];
  uint8_t near_[kMost], edge_[kMost];
};

// Where coding of a band begins: with a row, and the quantisers' state.
struct BandStart {
  uint32_t row;
  int state;
};

// For decoders that do not go on later: see code_band.
struct NoCheckpoints {
  static constexpr BandStart start = {0, 0};
  static bool due(size_t) { return false; }
  template <class Coder>
  static void save(const Coder&, BandStart) {}
};

// Codes a band of a patch. Stops early and leaves the rest zero when a cut stream ends. Returns false then.
// checkpoints: where to begin, and who keeps the coder's state at the beginning of a row where it is due.
template <class Coder, class Checkpoints = NoCheckpoints>
bool code_band(Coder& outer, CoefficientModels& models, const Pyramid& p, int32_t* q, const uint8_t* m,
               int level, int type, const Leaves& leaves = best_leaves(), Checkpoints checkpoints = {}) {
  const Band& b = p.high[level][type];
  const ActivityWeights& k = kActivityWeights[type];
  CoderCopy<Coder> coder(outer);
  SpanContext span;
  int state = checkpoints.start.state;
  for (uint32_t y = checkpoints.start.row; y < b.height; y++) {
    if constexpr (!Coder::kEncoding) {
      if (checkpoints.due((*coder).left()))
        checkpoints.save(Coder(*coder), {y, state});  // of a copy: see CoderCopy
    }
    int32_t* const c = q + b.at(0, y);
    const uint8_t* const in = m + b.at(0, y);
    for (uint32_t x = 0; x < b.width;) {
      if (!in[x]) {
        x++;
        continue;
      }
      x &= ~1u;
      const uint32_t begin = x;
      uint32_t end = b.width - x < SpanContext::kMost ? b.width : x + SpanContext::kMost;
      while (!in[end - 1]) end--;
      span.gather(leaves, p, q, m, level, type, x, y, end - x);
      uint32_t W = uint32_t(coded_magnitude(c[ptrdiff_t(x) - 1])),
               WW = uint32_t(coded_magnitude(c[ptrdiff_t(x) - 2]));
      for (; x < end; x++) {
        if (in[x]) {
          const Context context = span.at(x - begin, models, k, W, WW);
          c[x] = code_coefficient(*coder, models, context, level, type, state, c[x],
                                  [&] { return sign_context(c + x, b.stride); });
        }
        WW = W;
        W = uint32_t(coded_magnitude(c[x]));
      }
    }
    if constexpr (!Coder::kEncoding) {
      if ((*coder).exhausted()) {
        for (uint32_t x = 0; x < b.width; x++) c[x] = 0;
        return false;
      }
    }
  }
  return true;
}

}  // namespace relief
