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

// Looks for the thorough trial of these patches with the step, or of bisk the cut, that just keeps within the
// target: with the masks held, error and bytes follow it smoothly. Once near they are mended for that step.
class Settling {
 public:
  // excess: about what it is without another step.
  Settling(const Job& m, Sampled s, double excess, double bytes, Stopwatch& watch)
      : m_(m),
        s_(std::move(s)),
        bytes_(bytes),
        watch_(watch),
        bisk_(s_.placement.bisk),
        unknown_(bisk_       ? (bytes > 0 ? 0.85 : -0.9)
                 : bytes > 0 ? -0.9
                             : 0.6),
        course_(unknown_),
        finest_(finest_step(s_.patches)),
        x_(std::log(double(s_.placement.step))) {
    if (bisk_) return;
    course_.add(x_, excess);
    x_ = course_.next(kAim);
    course_ = unknown_;
    take_step();
  }

  // met: whether any trial did; then also whether this one does.
  Trial run(bool& met) {
    constexpr int kMost = 7, kVain = 3;
    constexpr double kContent = 0.003, kDeeper = 0.002, kHopeless = 0.02;  // in the logarithm
    if (!s_.mended) mend(m_, s_, kMendRounds, watch_);
    for (int i = 0; i < kMost; i++) {
      try_step(i == 0);
      if (!met || (best_y_ <= 0 && best_y_ > -(kInside + kContent * std::max(0, i - 2)))) break;
      if (i + 1 == kVain && best_y_ > kHopeless) break;
      x_ = course_.next(kAim + kDeeper * i);  // deeper inside with every trial in vain
      take_step();
    }
    met = best_y_ <= 0;
    if (m_.options.unquantised) best_.unquantised = unquantised();
    return std::move(best_);
  }

 private:
  static constexpr int kMendRounds = 2;
  static constexpr double kInside = 0.008, kAim = 0.004;  // of the target, in the logarithm

  void take_step() {
    if (bisk_)
      s_.placement.coefficient_bytes = std::max<size_t>(1, size_t(std::exp(x_)));
    else
      s_.placement.step = float(std::clamp(std::exp(x_), finest_, kMostStep));
  }

  // The first step is the one that the masks were mended for.
  void try_step(bool first) {
    Trial t = code(m_, s_, true, watch_);
    if (bisk_) x_ = std::log(double(std::max<size_t>(1, t.coefficient_bytes)));
    double y = measured(t);
    const bool near = !first && !mended_near_ && y <= 0 && y > -kInside;
    if (near || t.coincident > 0) {
      mended_near_ = mended_near_ || near;
      mend(m_, s_, near ? kMendRounds : 0, watch_);
      Trial again = code(m_, s_, true, watch_);
      if (again.stream != t.stream) {
        const double again_y = measured(again);
        if (near && again_y > 0) take_if_better(t, y);
        t = std::move(again), y = again_y;
        course_ = unknown_;
      }
    }
    course_.add(x_, y);
    take_if_better(t, y);
  }

  double measured(Trial& t) {
    t.error = measure(m_, t, watch_);
    return excess(t, m_.options, bytes_);
  }

  void take_if_better(Trial& t, double y) {
    const bool sound = is_sound(m_, t), best_sound = is_sound(m_, best_);
    const bool better = best_y_ > 0 || y > 0 ? y < best_y_ : is_better(t, best_, bytes_);
    if (best_y_ == INFINITY || (sound == best_sound ? better : sound)) best_ = std::move(t), best_y_ = y;
  }

  std::vector<uint8_t> unquantised() {
    s_.placement.step = float(finest_);
    s_.placement.trade = 0;
    s_.quantised = {};
    s_.placement.coefficient_bytes = SIZE_MAX;
    return code(m_, s_, true, watch_).stream;
  }

  const Job& m_;
  Sampled s_;
  const double bytes_;  // the target; 0: it is one of error
  Stopwatch& watch_;
  const bool bisk_;
  const Course unknown_;
  Course course_;
  const double finest_;  // step
  double x_;             // of the next trial
  Trial best_;
  double best_y_ = INFINITY;
  bool mended_near_ = false;
};

}  // namespace

Trial last_word(const Job& m, Trial nearest, double bytes, bool& met, Stopwatch& watch) {
  constexpr int kMost = 4;
  constexpr double kFurther = 0.02;  // inside of the target, more with every trial
  const double slope = (bytes > 0 ? -1 : 1) * kUsualSlope;
  double lambda = nearest.lambda;
  const bool reachable = met;
  const double excess_before = met ? excess(nearest, m.options, bytes) : 0;
  Trial t = Settling(m, std::move(nearest.sampled), excess_before, bytes, watch).run(met);
  for (int i = 1; i < kMost && reachable && !met; i++) {
    lambda *= std::exp(-(excess(t, m.options, bytes) + kFurther * i) / slope);
    met = true;
    t = Settling(m, sample(m, lambda, watch), 0, bytes, watch).run(met);
  }
  return t;
}

}  // namespace relief
