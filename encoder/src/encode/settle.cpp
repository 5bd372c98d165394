#include "encode/settle.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace relief {
namespace {

// What trials with the same masks tell of the excess y over x, the logarithm of the step or of the bytes of
// coefficients.
class Course {
 public:
  explicit Course(double usual_slope) : usual_(usual_slope) {}

  void add(double x, double y) {
    (y <= 0 ? inside_ : outside_).add(x, y);
    last_ = {{last_[1], {x, y}}};
  }

  // Where y is about -aim. Where errors of gaps jump the bracket closes: then as if nothing were known beyond
  // the target.
  double next(double aim) const {
    constexpr double kNarrow = 0.003, kMostWay = 0.3;
    if (inside_.known() && outside_.known() && std::fabs(outside_.x - inside_.x) > kNarrow)
      return inside_.x - (inside_.y + aim) * (outside_.x - inside_.x) / (outside_.y - inside_.y);
    const Point& p = inside_.known() ? inside_ : outside_;
    return p.x + std::clamp(-(p.y + aim) / slope(), -kMostWay, kMostWay);
  }

 private:
  struct Point {
    double x = 0, y = INFINITY;
    bool known() const { return y < INFINITY; }
    void add(double new_x, double new_y) {
      if (!known() || std::fabs(new_y) < std::fabs(y)) x = new_x, y = new_y;
    }
  };

  // By the last two trials, but about what is usual.
  double slope() const {
    if (!last_[0].known() || std::fabs(last_[1].x - last_[0].x) < 1e-9) return usual_;
    const double seen = (last_[1].y - last_[0].y) / (last_[1].x - last_[0].x);
    return usual_ * std::clamp(seen / usual_, 0.5, 1.5);
  }

  double usual_;
  Point inside_, outside_;
  std::array<Point, 2> last_;
};

// The thorough trial of these patches with the step, or of bisk the cut, that just keeps within the target:
// with the masks held, error and bytes follow it smoothly. Once near they are mended for that step.
// excess_before: about what it is without another step. met: whether any trial did; then also whether this
// one does.
Trial settle(const Job& m, Sampled s, double excess_before, double bytes, bool& met, Stopwatch& watch) {
  constexpr int kMost = 7, kMendRounds = 2, kVain = 3;
  constexpr double kInside = 0.008, kContent = 0.003, kAim = 0.004, kDeeper = 0.002,
                   kHopeless = 0.02;  // in the logarithm
  const bool bisk = s.placement.bisk;
  const Course unknown(bisk ? (bytes > 0 ? 0.85 : -0.9) : bytes > 0 ? -0.9 : 0.6);
  Course course = unknown;
  Trial best;
  double best_y = INFINITY;
  double x = std::log(double(s.placement.step));
  auto measured = [&](Trial& t) {
    t.error = measure(m, t, watch);
    return excess(t, m.options, bytes);
  };
  auto take_if_better = [&](Trial& t, double y) {
    const bool sound = is_sound(m, t), best_sound = is_sound(m, best);
    const bool better = best_y > 0 || y > 0 ? y < best_y : is_better(t, best, bytes);
    if (best_y == INFINITY || (sound == best_sound ? better : sound)) best = std::move(t), best_y = y;
  };
  const double finest = finest_step(s.patches);
  auto take_step = [&] { s.placement.step = float(std::clamp(std::exp(x), finest, kMostStep)); };
  if (!bisk) {  // the search's trial tells about how far it is
    course.add(x, excess_before);
    x = course.next(kAim);
    course = unknown;
    take_step();
  }
  if (!s.mended) mend(m, s, kMendRounds, watch);
  bool mended_near = false;
  for (int i = 0; i < kMost; i++) {
    if (!bisk)
      take_step();
    else if (i > 0)
      s.placement.coefficient_bytes = std::max<size_t>(1, size_t(std::exp(x)));
    Trial t = code(m, s, true, watch);
    if (bisk) x = std::log(double(std::max<size_t>(1, t.coefficient_bytes)));
    double y = measured(t);
    const bool near = i > 0 && !mended_near && y <= 0 && y > -kInside;
    if (near || t.coincident > 0) {
      mended_near = mended_near || near;
      mend(m, s, near ? kMendRounds : 0, watch);
      Trial again = code(m, s, true, watch);
      if (again.stream != t.stream) {
        const double again_y = measured(again);
        if (near && again_y > 0) take_if_better(t, y);
        t = std::move(again), y = again_y;
        course = unknown;
      }
    }
    course.add(x, y);
    take_if_better(t, y);
    if (!met || (best_y <= 0 && best_y > -(kInside + kContent * std::max(0, i - 2)))) break;
    if (i + 1 == kVain && best_y > kHopeless) break;
    x = course.next(kAim + kDeeper * i);  // deeper inside with every trial in vain
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
  const double excess_before = met ? excess(nearest, m.options, bytes) : 0;
  Trial t = settle(m, std::move(nearest.sampled), excess_before, bytes, met, watch);
  for (int i = 1; i < kMost && reachable && !met; i++) {
    lambda *= std::exp(-(excess(t, m.options, bytes) + kFurther * i) / slope);
    met = true;
    t = settle(m, sample(m, lambda, watch), 0, bytes, met, watch);
  }
  return t;
}

}  // namespace relief
