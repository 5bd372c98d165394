#include "encode/settle.h"

#include <algorithm>
#include <cmath>

namespace relief {
namespace {

// Of the target, in the logarithm: trials end when one is as far inside as the effort allows, more with every
// trial, or when all of the first are so far outside; the next one aims so far inside.
constexpr double kContent = 0.003, kHopeless = 0.02, kAim = 0.002;
// The first trial makes up for what the search is off, if that is so much. If it is so far outside then, the
// search was wrong.
constexpr double kFarOff = 0.02, kJump = 0.05;
constexpr double kSame = 0.01;  // steps that differ by less need no other masks
// What has lost its topology is tried again with other masks, so much of the step inside.
constexpr double kOtherwise = kSame * 4 / 3;

// A trial with all care; no vertex lies on another if that can be helped. Where mending is yet to be
// finished, one to aim by, if it is good enough for that. bytes: the target
Trial code_soundly(const Job& m, Sampled& s, double bytes, Stopwatch& watch) {
  Trial t = code(m, s, s.finished ? Care::kAll : Care::kToAim, watch);
  if (t.coincident > 0) {
    mend(m, s, {0, 0}, watch);
    t = code(m, s, Care::kAll, watch);
  }
  const bool known_about = bytes == 0 && t.error > 0;  // well enough, or else find_seams has measured it
  if (!t.measured && !known_about) measure(m, t, watch);
  return t;
}

// The stream without quantisation.
std::vector<uint8_t> unquantised(const Job& m, Sampled& s, Stopwatch& watch) {
  s.placement.step = float(finest_step(s.patches));
  s.placement.trade = 0;
  s.quantised = {};
  s.placement.coefficient_bytes = SIZE_MAX;
  return code(m, s, Care::kAll, watch).stream;
}

// The trial of these patches with the step, or of bisk the cut, that just keeps within the target.
// Masks are mended for each: their error jumps by a percent, which Steiner points take up.
//   off  by how much these patches with this step miss the target, as far as the search knows
//   met  whether any trial met the target; then also whether this one does
Trial settle(const Job& m, Sampled s, double off, double bytes, bool& met, Stopwatch& watch) {
  constexpr int kMost = 6, kVain = 3, kMostUnsound = 2;
  constexpr MendRounds kHasty = {2, 0}, kThorough = {2, 6};
  const bool bisk = s.placement.bisk;
  // slope of the excess y over x, the logarithm of the step or of the bytes of coefficients
  const double slope = bisk ? (bytes > 0 ? 0.85 : -0.9) : bytes > 0 ? -0.9 : 0.6;
  const double finest = finest_step(s.patches);
  Trial best;
  double best_y = INFINITY;
  bool best_finished = false;
  int unsound = 0;
  const double first_x = std::log(double(s.placement.step));
  const bool corrected = !bisk && met && std::fabs(off) > kFarOff;
  double x = corrected ? first_x + std::clamp(-off / slope, -0.3, 0.3) : first_x;
  double mended_x = s.mended ? first_x : INFINITY;
  for (int i = 0; i < kMost; i++) {
    if (!bisk)
      s.placement.step = float(std::clamp(std::exp(x), finest, kMostStep));
    else if (i > 0)
      s.placement.coefficient_bytes = std::max<size_t>(1, size_t(std::exp(x)));
    if (i > 0) s.known = {};           // another step moves all vertices
    const bool hasty = i == 0 && met;  // another trial may follow
    if (std::fabs(x - mended_x) > kSame || (!hasty && !s.finished))
      mend(m, s, hasty ? kHasty : kThorough, watch), mended_x = x;
    Trial t = code_soundly(m, s, bytes, watch);
    if (bisk) x = std::log(double(std::max<size_t>(1, t.coefficient_bytes)));
    const double y = excess(t, m.options, bytes);
    const bool sound = is_sound(m, t) && s.finished, best_sound = is_sound(m, best) && best_finished;
    const bool better = best_y > 0 || y > 0 ? y < best_y : is_better(t, best, bytes);
    if (i == 0 || (sound == best_sound ? better : sound))
      best = std::move(t), best_y = y, best_finished = s.finished;
    const bool content = best_y <= 0 && best_y > -(m.effort.inside + kContent * std::max(0, i - 2));
    const bool settled = content && best_finished;
    if (!met || (settled && (is_sound(m, best) || unsound == kMostUnsound))) break;
    if (settled) x -= std::copysign(kOtherwise, slope), unsound++;
    if (content) continue;
    if (i + 1 == kVain && best_y > kHopeless) break;
    const double aim = kAim * (i + 1);  // deeper inside with every trial in vain
    if (i == 0 && corrected && y > kJump)
      x -= (x - first_x) * (y + aim) / (y - off);  // something was lost on the way
    else
      x += std::clamp(-(y + aim) / slope, -0.3, 0.3);
  }
  if (!best.measured) measure(m, best, watch), best_y = excess(best, m.options, bytes);
  met = best_y <= 0;
  if (m.options.unquantised) best.unquantised = unquantised(m, s, watch);
  return best;
}

}  // namespace

Trial last_word(const Job& m, Trial nearest, double bytes, bool& met, Stopwatch& watch) {
  constexpr int kMost = 4;
  constexpr double kFurther = 0.02;  // inside of the target, more with every trial
  const double slope = (bytes > 0 ? -1 : 1) * kUsualSlope;
  const double first = nearest.lambda;
  double lambda = first;
  const bool reachable = met;
  const double off = excess(nearest, m.options, bytes);
  Trial t = settle(m, std::move(nearest.sampled), off, bytes, met, watch);
  for (int i = 1; i < kMost && reachable && !met; i++) {
    lambda *= std::exp(-(excess(t, m.options, bytes) + kFurther * i) / slope);
    met = true;
    t = settle(m, sample(m, lambda, watch), 0, bytes, met, watch);
  }
  // Where coarse grids reach over the border of a surface, no lambda tells: finer ones then.
  const bool may_refine = reachable && bytes == 0 && m.options.density == 0;
  for (double density = 1; density >= 0.25 && may_refine && !met; density /= 2) {
    met = true;
    t = settle(m, sample(m, first, watch, density), 0, bytes, met, watch);
  }
  return t;
}

}  // namespace relief
