#include "encode/search.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "encode/settle.h"

namespace relief {
namespace {

// Lambda over the fourth power of the lattice's diagonal is about that times a power of the error, on scans,
// points and generated meshes alike, within a factor of 2.
constexpr double kUsualLambda = 0.9;
constexpr int kMaxTrials = 12;
constexpr int kPatience = 3;         // trials, after which each may be twice as far from the target
constexpr double kHopeless = 0.03;   // what more trials gain at most, mostly: of cost
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
  constexpr MendRounds kHasty = {3, 0};
  Sampled sampled = sample(m, lambda, watch);
  if (mended) mend(m, sampled, kHasty, watch);
  Trial t = code(m, sampled, Care::kLittle, watch);
  t.error = measure_roughly(m, t, watch);
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

// What trials of one partition tell.
struct Trials {
  Bracket bracket;
  std::unique_ptr<Patching> patching = nullptr;  // while it is not the job's
  double least_cost = INFINITY;
  Trial best = {};
  double best_rank = INFINITY, best_x = 0, best_y = INFINITY;

  void add(Trial t, double x, double y, double near) {
    bracket.add(x, y);
    least_cost = std::min(least_cost, cost(t));
    const double r = rank(t, y, near);
    if (r < best_rank) best_rank = r, best_x = x, best_y = y, best = std::move(t);
  }
};

// The search for the Lagrangian parameter, in its logarithm. The first trial near the target tells what
// patches miss, which is split off. What was known before is kept, in case that does no good.
class Search {
 public:
  Search(Job& m, double bytes, double lambda, double rival, Stopwatch& watch)
      : m_(m),
        bytes_(bytes),
        rival_(rival),
        watch_(watch),
        now_{all_lambdas(m, (bytes > 0 ? -1 : 1) * kUsualSlope)} {
    const double target = bytes > 0 ? 1e-4 : m.options.error;
    const double usual =
        std::log(kUsualLambda) + 4 * std::log(kLatticeDiagonal) + std::log(target) / kUsualSlope;
    x_ = std::clamp(lambda > 0 ? std::log(lambda) : usual, now_.bracket.least, now_.bracket.most);
  }

  // Bisection (3.6), with the secant as the first guess, until a trial is near the target; the last word does
  // the rest.
  Found run() {
    for (int i = 0; i < kMaxTrials; i++) {
      report(m_.options, "allocate and code", 0.45 + 0.55 * i / kMaxTrials);
      Trial t = try_lambda(m_, std::exp(x_), is_split(), watch_);
      const double y = excess(t, m_.options, bytes_);
      const double near = m_.effort.near * std::exp2(std::max(0, i + 1 - kPatience));
      const bool hopeless = i == 0 && cost(t) > rival_ + kHopeless;
      std::unique_ptr<Patching> others = hopeless ? nullptr : other_patches(t, y);
      now_.add(std::move(t), x_, y, near);
      if (hopeless) break;
      if (others) {
        change_patches(std::move(others), y);
        continue;
      }
      if (is_split() && now_.least_cost > whole_->least_cost + harm()) {
        take_back();
        x_ = now_.bracket.next(now_.best_x, now_.best_y);
        continue;
      }
      const double next = now_.bracket.next(x_, y);
      if (std::min(std::fabs(y), std::fabs(now_.best_y)) < near || next == x_) break;
      x_ = next;
    }
    if (is_split() && whole_->best_rank < now_.best_rank) take_back();
    const double least = cost(now_.best);
    return {std::move(now_.best), now_.best_rank < kOutside, least, std::move(m_.patching)};
  }

 private:
  bool is_split() const { return whole_.has_value(); }

  // By how much costs may be higher than before the split: less once there is no other split to try.
  double harm() const { return looks_ < m_.effort.looks ? 0.5 : 0.03; }

  // Patches for what this trial misses, if it is time to look for that: once, and again while it did not
  // help.
  std::unique_ptr<Patching> other_patches(const Trial& t, double y) {
    constexpr double kNearToSplit = 0.5;
    if (looks_ == m_.effort.looks) return nullptr;
    if (is_split() ? std::min(cost(t), now_.least_cost) <= whole_->least_cost
                   : looks_ > 0 || std::fabs(y) >= kNearToSplit)
      return nullptr;
    if (looks_++ == 0) first_error_ = t.error;
    return split_what_is_missed(m_, t.mesh, first_error_, t.lambda, watch_);
  }

  void change_patches(std::unique_ptr<Patching> others, double y) {
    Trials fresh = {all_lambdas(m_, now_.bracket.slope)};
    if (!is_split()) {
      x_ = fresh.bracket.next(x_, y);
      now_.patching = std::move(m_.patching);
      whole_ = std::move(now_);
    }
    m_.patching = std::move(others);
    now_ = std::move(fresh);
  }

  void take_back() {
    now_ = std::move(*whole_);
    whole_.reset();
    m_.patching = std::move(now_.patching);
    looks_ = m_.effort.looks;
  }

  Job& m_;
  const double bytes_;  // the target; 0: it is one of error
  const double rival_;
  Stopwatch& watch_;
  double x_;                     // of the next trial
  Trials now_;                   // of the patches at hand
  std::optional<Trials> whole_;  // of those before the split, if they were split
  int looks_ = 0;                // for what is missed
  double first_error_ = 0;       // when that was looked for first
};

}  // namespace

Found search(Job& m, double bytes, double lambda, double rival, Stopwatch& watch) {
  return Search(m, bytes, lambda, rival, watch).run();
}

}  // namespace relief
