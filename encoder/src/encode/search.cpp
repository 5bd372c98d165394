#include "encode/search.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "encode/settle.h"

namespace relief {
namespace {

constexpr double kUsualStep = 4.5;  // times spacing, over error times mean vertex spacing
constexpr int kMaxTrials = 12;
constexpr int kPatience = 3;         // trials, after which each may be twice as far from the target
constexpr double kNarrowest = 0.01;  // of the bracket, in the logarithm of lambda
// Steps that are tried, in lattice units at the mean vertex spacing: the format's finest is 1/64 at any
// patch.
constexpr double kFinestStep = 2, kCoarsestStep = 1 << 16;

// Where the target lies, as far as trials tell: logarithms of lambda with the excess there.
struct Bracket {
  struct Point {
    double x, y;
  };
  double least, most;  // x that are tried
  double slope;        // of y over x
  std::optional<Point> inside = std::nullopt, outside = std::nullopt;

  void add(double x, double y) { (y <= 0 ? inside : outside) = Point{x, y}; }

  // The next x to try after this one, which is the same if there is nothing left to try.
  double next(double x, double y) {
    if (!inside || !outside) return std::clamp(x + std::clamp(-y / slope, -3.0, 3.0), least, most);
    const double lo = std::min(inside->x, outside->x), hi = std::max(inside->x, outside->x);
    if (hi - lo < kNarrowest) return x;
    // aim at the target, but keep the bracket shrinking
    slope = (outside->y - inside->y) / (outside->x - inside->x);
    return std::clamp(inside->x - inside->y / slope, lo + 0.15 * (hi - lo), hi - 0.15 * (hi - lo));
  }
};

Bracket all_lambdas(const Job& m, double slope) {
  const double trade = std::log(kTrade);
  return {trade + 2 * std::log(kFinestStep * m.spacing), trade + 2 * std::log(kCoarsestStep * m.spacing),
          slope};
}

// A stream for the search. Once patches were split it is mended, too: small patches make many mistakes.
Trial try_lambda(const Job& m, double lambda, bool mended, Stopwatch& watch) {
  constexpr int kMendRounds = 3;
  Sampled sampled = sample(m, lambda, watch);
  if (mended) mend(m, sampled, kMendRounds, watch);
  Trial t = code(m, sampled, false, watch);
  t.error = measure(m, t, watch);
  t.lambda = lambda;
  t.sampled = std::move(sampled);
  return t;
}

// The logarithm of what a trial would take at another error, but for a constant: errors of gaps jump from
// trial to trial.
double cost(const Trial& t) {
  constexpr double kBytesByError = 1.2;  // slope of bytes over error, in logarithms
  return std::log(double(t.stream.size())) + kBytesByError * std::log(t.error);
}

// Of two trials the last word takes the one of lower rank: of those near the target the one of lower cost,
// counting what the way to the target costs, else the nearest inside of it, else the nearest.
constexpr double kNotNear = 1e3, kOutside = 2e3;
double rank(const Trial& t, double y, double near) {
  constexpr double kWithin = 0.12, kWay = 0.15;
  if (y >= near) return kOutside + y;
  return y < -kWithin ? kNotNear - y : cost(t) + kWay * std::fabs(y);
}

// The search for the Lagrangian parameter, in its logarithm. The first trial near the target tells what
// patches miss.
class Search {
 public:
  Search(Job& m, double bytes, Stopwatch& watch)
      : m_(m), bytes_(bytes), watch_(watch), bracket_(all_lambdas(m, (bytes > 0 ? -1 : 1) * kUsualSlope)) {
    const double target = bytes > 0 ? 1e-4 : m.options.error;
    const double step = target * kLatticeDiagonal * kUsualStep * m.spacing;  // times spacing
    x_ = std::clamp(std::log(kTrade * step * step), bracket_.least, bracket_.most);
  }

  // Bisection (3.6), with the secant as the first guess, until a trial is near the target; the last word does
  // the rest.
  Trial run(bool& met) {
    for (int i = 0; i < kMaxTrials; i++) {
      report(m_.options, "allocate and code", 0.45 + 0.55 * i / kMaxTrials);
      Trial t = try_lambda(m_, std::exp(x_), split_, watch_);
      const double y = excess(t, m_.options, bytes_);
      if (changes_patches(t, y)) continue;
      const double near = m_.effort.near * std::exp2(std::max(0, i + 1 - kPatience));
      bracket_.add(x_, y);
      const double next = bracket_.next(x_, y), r = rank(t, y, near);
      if (r < best_rank_) best_rank_ = r, best_ = std::move(t);
      if (std::fabs(y) < near || next == x_) break;
      x_ = next;
    }
    met = best_rank_ < kOutside;
    return last_word(m_, std::move(best_), bytes_, met, watch_);
  }

 private:
  // Splits what patches miss, looks again where that did not help yet, and takes it back where it did harm.
  // True: the trial is of other patches than the next.
  bool changes_patches(const Trial& t, double y) {
    constexpr double kNearToSplit = 0.5, kHarm = 0.5;
    if (looks_ == 0) {
      if (m_.effort.looks == 0 || std::fabs(y) >= kNearToSplit) return false;
      looks_++, first_error_ = t.error, first_cost_ = cost(t);
      whole_ = m_.partition;
      if (!split_what_is_missed(m_, t.mesh, first_error_, t.lambda, watch_)) return false;
      split_ = true;
      before_ = std::exchange(bracket_, all_lambdas(m_, bracket_.slope));
      before_.add(x_, y);
      x_ = bracket_.next(x_, y);
    } else if (split_ && cost(t) > first_cost_ + kHarm) {
      split_ = false, looks_ = m_.effort.looks;
      m_.partition = std::move(whole_);
      gather(m_, watch_);
      bracket_ = before_;
      x_ = bracket_.next(x_, y);
    } else if (split_ && cost(t) > first_cost_ && looks_ < m_.effort.looks) {
      looks_++;
      if (!split_what_is_missed(m_, t.mesh, first_error_, t.lambda, watch_)) return false;
      bracket_ = all_lambdas(m_, bracket_.slope);
    } else {
      return false;
    }
    best_rank_ = INFINITY;
    return true;
  }

  Job& m_;
  const double bytes_;  // the target; 0: it is one of error
  Stopwatch& watch_;
  Bracket bracket_;
  double x_;  // of the next trial
  Trial best_;
  double best_rank_ = INFINITY;
  int looks_ = 0;  // for what is missed
  bool split_ = false;
  // What it was before the split, and what the last trial then was.
  Partition whole_;
  Bracket before_ = bracket_;
  double first_error_ = 0, first_cost_ = 0;
};

}  // namespace

Trial search(Job& m, double bytes, bool& met, Stopwatch& watch) { return Search(m, bytes, watch).run(met); }

}  // namespace relief
