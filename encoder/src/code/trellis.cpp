#include "code/trellis.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "code/quantise.h"
#include "code/range_encoder.h"

namespace relief {
namespace {

constexpr float kBeam = 3;  // paths that cost so much more than the best, in squared steps, are left

// A coefficient of the band, and what its context is for every path.
struct Place {
  size_t at;  // in the planes
  uint32_t x;
  float value;  // in steps of the band
  uint32_t bands;
  bool edge;
};

// The cheapest way to a state.
struct Path {
  float cost;
  uint32_t W, WW;  // its last coded magnitudes
  int ancestor;    // its state at the beginning of the row
};
using Paths = std::array<Path, kTrellisStates>;

// How a path came to a state.
struct Decision {
  uint32_t k : 27, from : 5;
};

// What the values of a quantiser that may be taken cost in a context: zero, and the two that are nearest.
struct Offers {
  int activity, near, count;
  int32_t k[3];
  float cost[3];
};
using Decisions = std::array<Decision, kTrellisStates>;

// Coded magnitudes along a path: two rows with margins.
struct Rows {
  uint32_t *above, *above2;
};

class BandTrellis {
 public:
  BandTrellis(CoefficientModels& models, const WaveletImage& image, int level, int type, float step,
              float trade, const int32_t* q)
      : models_(models),
        image_(image),
        band_(image.pyramid.high[level][type]),
        level_(level),
        type_(type),
        inverse_(1 / (step * band_step(level, type))),
        trade_(trade),
        q_(q),
        magnitudes_(4 * kTrellisStates * size_t(band_.stride), 0) {
    for (int s = 0; s < kTrellisStates; s++) paths_[s] = {s == 0 ? 0 : INFINITY, 0, 0, s};
    uint32_t* row = magnitudes_.data();
    auto take = [&] { return std::exchange(row, row + band_.stride); };
    for (auto* set : {&rows_, &next_rows_})
      for (Rows& r : *set) r = {take(), take()};
  }

  void add_row(uint32_t y) {
    const size_t first = places_.size();
    find_places(y);
    for (int s = 0; s < kTrellisStates; s++) paths_[s].W = paths_[s].WW = 0, paths_[s].ancestor = s;
    for (size_t i = first; i < places_.size(); i++) {
      if (i > first) skip(places_[i].x - places_[i - 1].x - 1);
      extend(places_[i]);
    }
    keep_rows(first);
    learn(first);
  }

  // Writes the best path's values. Returns their squared error, in steps of the band.
  double finish(int32_t* q) const {
    double squared = 0;
    int s = best();
    for (size_t i = places_.size(); i-- > 0;) {
      const Decision d = decisions_[i][size_t(s)];
      s = d.from;
      const int32_t v = value_of(int32_t(d.k), s);
      q[places_[i].at] = places_[i].value < 0 ? -v : v;
      squared += error(std::fabs(places_[i].value), v);
    }
    return squared;
  }

 private:
  static int32_t value_of(int32_t k, int state) { return k ? 2 * k - quantiser_of(state) : 0; }
  static float error(float value, int32_t q) {
    const float d = value - dequantise(q, 1);
    return d * d;
  }

  void find_places(uint32_t y) {
    for (uint32_t x = 0; x < band_.width; x++) {
      const size_t at = band_.at(x, y);
      const uint8_t* const in = &image_.mask[at];
      if (*in)
        places_.push_back({at, x, image_.value[at] * inverse_,
                           weigh_bands(image_.pyramid, q_, level_, type_, x, y), at_edge(in, band_.stride)});
    }
  }

  // Goes over places outside of the mask.
  void skip(uint32_t n) {
    if (n == 0) return;
    for (Path& p : paths_) p.WW = n == 1 ? p.W : 0, p.W = 0;
  }

  Context context(const Place& place, const Rows& rows, uint32_t W, uint32_t WW) const {
    const uint32_t* const above = &rows.above[place.x + kMargin];
    return context_of(type_, {W, above[0], above[-1], above[1], WW, rows.above2[place.x + kMargin]},
                      place.bands, place.edge);
  }

  // All paths by one coefficient.
  void extend(const Place& place) {
    Paths next;
    for (Path& p : next) p.cost = INFINITY;
    Decisions& decisions = decisions_.emplace_back();
    offers_[0].clear(), offers_[1].clear();
    const float most = paths_[best()].cost + kBeam;
    for (int s = 0; s < kTrellisStates; s++) {
      const Path& path = paths_[s];
      if (!(path.cost < most)) continue;
      const Offers& offers = offers_at(place, context(place, rows_[path.ancestor], path.W, path.WW), s);
      for (int i = 0; i < offers.count; i++) {
        const int32_t k = offers.k[i];
        const float cost = path.cost + offers.cost[i];
        const int t = next_state(s, k);
        if (!(cost < next[t].cost)) continue;
        next[t] = {cost, uint32_t(k), path.W, path.ancestor};
        decisions[size_t(t)] = {uint32_t(k), uint32_t(s)};
      }
    }
    paths_ = next;
  }

  // Most paths have been one until a few places ago: their contexts are the same.
  const Offers& offers_at(const Place& place, const Context& c, int state) {
    const int quantiser = quantiser_of(state);
    for (const Offers& o : offers_[quantiser])
      if (o.activity == c.activity && o.near == c.near) return o;
    Offers& o = offers_[quantiser].emplace_back(Offers{c.activity, c.near, 0, {}, {}});
    const float a = std::fabs(place.value);
    auto offer = [&](int32_t k, float bits) {
      o.k[o.count] = k;
      o.cost[o.count++] = error(a, value_of(k, state)) + trade_ * bits;
    };
    const BitModels zero = zero_models(models_, c, level_, type_, quantiser);
    offer(0, bits_of(models_.logistic, c, zero, 0));
    const int32_t least = int32_t((a + float(quantiser)) / 2), most = least + 1;
    float bits = bits_of(models_.logistic, c, zero, 1) + kSignBits;
    for (int32_t k = 1; k < kUnary && k <= most; k++) {
      const BitModels greater = greater_models(models_, c, level_, type_, k);
      if (k >= least) offer(k, bits + bits_of(models_.logistic, c, greater, 0));
      bits += bits_of(models_.logistic, c, greater, 1);
    }
    for (int32_t k = std::max(least, kUnary); k <= most; k++) offer(k, bits + tail_bits(k));
    return o;
  }

  // Of every path the row that has just ended, whose places begin with `first`.
  void keep_rows(size_t first) {
    for (int end = 0; end < kTrellisStates; end++) {
      if (paths_[end].cost == INFINITY) continue;
      Rows& rows = next_rows_[end];
      std::copy_n(rows_[paths_[end].ancestor].above, band_.stride, rows.above2);
      std::fill_n(rows.above, band_.stride, 0u);
      int s = end;
      for (size_t i = places_.size(); i-- > first;) {
        const Decision d = decisions_[i][size_t(s)];
        rows.above[places_[i].x + kMargin] = d.k;
        s = d.from;
      }
    }
  }

  // The models learn the best path's row. Then the rows above are those of the next row.
  void learn(size_t first) {
    CountingCoder coder;
    const int end = best();
    const Rows& before = rows_[paths_[end].ancestor];
    const uint32_t* const row = next_rows_[end].above + kMargin;
    int state = paths_[end].ancestor;
    for (size_t i = first; i < places_.size(); i++) {
      const ptrdiff_t x = places_[i].x;
      const Context c = context(places_[i], before, row[x - 1], row[x - 2]);
      code_coefficient(coder, models_, c, level_, type_, state, value_of(int32_t(row[x]), state),
                       [] { return 0; });
    }
    std::swap(rows_, next_rows_);
  }

  int best() const {
    int r = 0;
    for (int s = 1; s < kTrellisStates; s++)
      if (paths_[s].cost < paths_[r].cost) r = s;
    return r;
  }

  CoefficientModels& models_;
  const WaveletImage& image_;
  const Band& band_;
  const int level_, type_;
  const float inverse_, trade_;
  const int32_t* const q_;
  Paths paths_;
  std::vector<uint32_t> magnitudes_;
  std::array<Rows, kTrellisStates> rows_, next_rows_;
  std::vector<Place> places_;
  std::vector<Decisions> decisions_;
  std::vector<Offers> offers_[2];  // at the place at hand, by quantiser
};

}  // namespace

double quantise_by_trellis(CoefficientModels& models, const WaveletImage& image, int level, int type,
                           float step, float trade, int32_t* q) {
  BandTrellis trellis(models, image, level, type, step, trade, q);
  for (uint32_t y = 0; y < image.pyramid.high[level][type].height; y++) trellis.add_row(y);
  return trellis.finish(q) * step * step;
}

}  // namespace relief
