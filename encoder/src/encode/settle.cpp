#include "encode/settle.h"

#include <algorithm>
#include <cmath>

namespace relief {
namespace {

// The thorough trial of these patches with the step, or of bisk the cut, that just keeps within the target:
// with the masks held, error and bytes follow it smoothly. met: whether any trial did; then also whether this
// one does.
Trial settle(const Job& m, Sampled s, double bytes, bool& met, Stopwatch& watch) {
  constexpr int kMost = 7, kMendRounds = 2, kVain = 3;
  constexpr double kInside = 0.008, kContent = 0.003, kAim = 0.002, kHopeless = 0.02,
                   kNarrow = 0.003;  // of the target, in the logarithm
  const bool bisk = s.placement.bisk;
  // slope of the excess y over x, the logarithm of the step or of the bytes of coefficients
  const double usual = bisk ? (bytes > 0 ? 0.85 : -0.9) : bytes > 0 ? -0.9 : 0.6;
  Trial best;
  double best_y = INFINITY, inside_x = 0, inside_y = -INFINITY, outside_x = 0, outside_y = INFINITY;
  double x = std::log(double(s.placement.step));
  auto measured = [&](Trial& t) {
    t.error = measure(m, t, watch);
    return excess(t, m.options, bytes);
  };
  if (!s.mended) mend(m, s, kMendRounds, watch);
  const double finest = finest_step(s.patches);
  for (int i = 0; i < kMost; i++) {
    if (!bisk)
      s.placement.step = float(std::clamp(std::exp(x), finest, kMostStep));
    else if (i > 0)
      s.placement.coefficient_bytes = std::max<size_t>(1, size_t(std::exp(x)));
    Trial t = code(m, s, true, watch);
    if (bisk) x = std::log(double(std::max<size_t>(1, t.coefficient_bytes)));
    double y = measured(t);
    const bool near = y <= 0 && y > -kInside;
    if ((i > 0 && near) || t.coincident > 0) {  // mended for another step
      mend(m, s, near ? kMendRounds : 0, watch);
      Trial again = code(m, s, true, watch);
      if (again.stream != t.stream) {  // what was known is of other masks
        t = std::move(again), y = measured(t);
        inside_y = -INFINITY, outside_y = INFINITY;
      }
    }
    if (y <= 0 && y > inside_y) inside_x = x, inside_y = y;
    const bool closed = inside_y > -INFINITY && outside_y < INFINITY;
    if (y > 0 && (closed ? std::fabs(x - inside_x) < std::fabs(outside_x - inside_x) : y < outside_y))
      outside_x = x, outside_y = y;
    const bool sound = is_sound(m, t), best_sound = is_sound(m, best);
    const bool better = best_y > 0 || y > 0 ? y < best_y : is_better(t, best, bytes);
    if (i == 0 || (sound == best_sound ? better : sound)) best = std::move(t), best_y = y;
    if (!met || (best_y <= 0 && best_y > -(kInside + kContent * std::max(0, i - 2)))) break;
    if (i + 1 == kVain && best_y > kHopeless) break;
    // where errors of gaps jump the bracket closes: then as if nothing were known beyond the target
    const bool bracket =
        inside_y > -INFINITY && outside_y < INFINITY && std::fabs(outside_x - inside_x) > kNarrow;
    if (!bracket && inside_y > -INFINITY) x = inside_x, y = inside_y;
    const double aim = kAim * (i + 1);  // deeper inside with every trial in vain
    const double slope = bracket ? (outside_y - inside_y) / (outside_x - inside_x) : usual;
    x = bracket ? inside_x - (inside_y + aim) / slope : x + std::clamp(-(y + aim) / slope, -0.3, 0.3);
  }
  met = best_y <= 0;
  if (m.options.unquantised) {
    s.placement.step = float(finest);
    s.placement.trade = 0;
    s.quantised = {};
    s.placement.coefficient_bytes = SIZE_MAX;
    best.unquantised = code(m, s, true, watch).stream;
  }
  return best;
}

}  // namespace

Trial last_word(const Job& m, Trial nearest, double bytes, bool& met, Stopwatch& watch) {
  constexpr int kMost = 4;
  constexpr double kFurther = 0.02;  // inside of the target, more with every trial
  const double slope = (bytes > 0 ? -1 : 1) * kUsualSlope;
  double lambda = nearest.lambda;
  const bool reachable = met;
  Trial t = settle(m, std::move(nearest.sampled), bytes, met, watch);
  for (int i = 1; i < kMost && reachable && !met; i++) {
    lambda *= std::exp(-(excess(t, m.options, bytes) + kFurther * i) / slope);
    met = true;
    t = settle(m, sample(m, lambda, watch), bytes, met, watch);
  }
  return t;
}

}  // namespace relief
