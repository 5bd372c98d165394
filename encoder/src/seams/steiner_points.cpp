#include "seams/steiner_points.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "gaps.h"
#include "measure/closest_point.h"

namespace relief {
namespace {

constexpr double kBytes = 2.4;          // that a point takes
constexpr double kBytesBySquare = 0.6;  // slope of bytes over the squared error, both in logarithms
constexpr double kLeastWorth = 0.3;     // of points that are added to keep within the target
constexpr double kPrice = 0.007;        // of keeping within the target at once, of all bytes
constexpr double kPromise = 0.95;       // heights fit the samples better than the surface
constexpr double kFold = -0.5;          // least cosine between normals of neighbours
// Of the target, in the logarithm. The error is foretold to be kAim inside; where that is within kFar, it is
// measured. What is measured may be as far inside as kContent; else points are chosen again, for kAim inside.
constexpr double kAim = 0.003, kFar = 0.012, kContent = 0.005;
constexpr int kCorrections = 3;

using Corners = std::array<Vec3, 3>;

// An edge from a to b of triangle t, with its corner c opposite, and of u, with d.
struct Edge {
  uint32_t t, u, edge;
  uint32_t a, b, c, d;
};

// What splitting an edge is worth.
struct Split {
  Edge edge;
  int32_t height = 0;
  Vec3 point = Vec3::Zero();
  double to_decoded = 0, to_original = 0;  // by how much the integrals of the squared distance are less
};

Vec3 normal_of(const Corners& c) { return (c[1] - c[0]).cross(c[2] - c[0]).normalized(); }

// The error of what is decoded, triangle by triangle, and which splits would lessen it.
class Splitter {
 public:
  // end: of the triangles of gaps
  Splitter(const SeamContext& in, const DecodedMesh& d, size_t end)
      : in_(in), d_(d), first_(d.patch_triangles()), end_(end), samples_(in.samples(d.mesh)) {
    const size_t triangles = d.mesh.triangles.size();
    first_sample_.assign(triangles + 1, 0);
    to_decoded_.assign(triangles, 0), to_original_.assign(triangles, 0);
    for (const auto& s : samples_.of_original)
      first_sample_[s.triangle + 1]++, add(s, to_decoded_, sum_to_decoded_, area_of_original_);
    for (const auto& s : samples_.of_other) add(s, to_original_, sum_to_original_, area_of_decoded_);
    for (size_t t = 0; t < triangles; t++) first_sample_[t + 1] += first_sample_[t];
    order_.resize(samples_.of_original.size());
    std::vector<uint32_t> at(first_sample_.begin(), first_sample_.end() - 1);
    for (uint32_t i = 0; i < order_.size(); i++) order_[at[samples_.of_original[i].triangle]++] = i;
    splits_ = worth_it(best_heights());
  }

  // target: of the error, 0: none; error: what they leave
  std::vector<SteinerPoint> choose(double target, double& error) const {
    Choice best;
    for (double weight : {0.5, 0.3, 0.7, 0.1, 0.9}) {
      Choice c = choose(splits_, weight, target * target);
      if (c.cost < best.cost) best = std::move(c);
    }
    error = std::sqrt(best.square);
    std::vector<SteinerPoint> points;
    for (const Split& s : best.splits) points.push_back({uint32_t(s.edge.t - first_), s.edge.edge, s.height});
    std::sort(points.begin(), points.end(),
              [](const SteinerPoint& x, const SteinerPoint& y) { return x.triangle < y.triangle; });
    return points;
  }

 private:
  static void add(const MutualSamples::Sample& s, std::vector<double>& of, double& sum, double& area) {
    of[s.triangle] += s.square * s.area;
    sum += s.square * s.area;
    area += s.area;
  }

  Vec3 at(uint32_t v) const { return in_.ground.lattice(d_.mesh.positions[v]); }
  Corners corners(uint32_t t) const {
    const auto& c = d_.mesh.triangles[t];
    return {at(c[0]), at(c[1]), at(c[2])};
  }

  // Bytes that a split saves elsewhere, over those that it takes. weight: of what it does for the original's
  // samples, against the others'.
  double worth(const Split& s, double weight = 0.5) const {
    const double bytes = double(in_.coded.table.size() + in_.coded.coefficients.size());
    const double gain =
        weight * s.to_decoded / area_of_original_ + (1 - weight) * s.to_original / area_of_decoded_;
    return gain / square_without({}) * kBytesBySquare * bytes / kBytes;
  }

  struct Totals {
    double to_decoded = 0, to_original = 0;
    void add(const Split& s) {
      to_decoded += kPromise * s.to_decoded, to_original += kPromise * s.to_original;
    }
  };
  // The larger error, squared.
  double square_without(const Totals& gone) const {
    return std::max((sum_to_decoded_ - gone.to_decoded) / area_of_original_,
                    (sum_to_original_ - gone.to_original) / area_of_decoded_);
  }

  struct Choice {
    std::vector<Split> splits;
    double cost = INFINITY, square = 0;  // of the error
  };

  // Logarithm of bytes at the same error, but for a constant.
  double cost(const Totals& gone, size_t points) const {
    const double bytes = double(in_.coded.table.size() + in_.coded.coefficients.size());
    return kBytesBySquare * std::log(square_without(gone)) + kBytes * double(points) / bytes;
  }

  // As many as are worth their bytes; or fewer or more, if that is enough to just keep within the target.
  Choice choose(std::vector<Split> splits, double weight, double target) const {
    std::stable_sort(splits.begin(), splits.end(),
                     [&](const Split& x, const Split& y) { return worth(x, weight) > worth(y, weight); });
    thin_out(splits);
    struct End {
      size_t count = 0;
      double cost = INFINITY, square = INFINITY;
    } worthy, within;
    Totals gone;
    for (size_t n = 0;; n++) {
      const End now = {n, cost(gone, n), square_without(gone)};
      if (n == 0 || worth(splits[n - 1], weight) > 1) worthy = now;
      if (within.square > target && now.square <= target) within = now;
      if (n == splits.size()) break;
      gone.add(splits[n]);
    }
    const End& end = within.cost < worthy.cost + kPrice ? within : worthy;
    splits.resize(end.count);
    return {std::move(splits), end.cost, end.square};
  }

  // Leaves one split of a triangle, the first.
  void thin_out(std::vector<Split>& splits) const {
    std::vector<char> taken(end_ - first_, 0);
    std::erase_if(splits, [&](const Split& s) {
      char &t = taken[s.edge.t - first_], &u = taken[s.edge.u - first_];
      return t || u || (t = u = 1, false);
    });
    splits.resize(std::min(splits.size(), size_t(most_steiner_points(in_.coded.boundary_nodes))));
  }

  // Edges between triangles of gaps where all of the error there would be worth it.
  std::vector<Edge> edges() const {
    std::vector<std::pair<std::array<uint32_t, 2>, uint32_t>> sides;  // of an edge, with its corner
    for (uint32_t t = uint32_t(first_); t < end_; t++)
      for (uint32_t k = 0; k < 3; k++)
        sides.push_back({{d_.mesh.triangles[t][k], d_.mesh.triangles[t][(k + 1) % 3]}, 3 * t + k});
    std::sort(sides.begin(), sides.end());
    std::vector<Edge> found;
    for (const auto& [ends, corner] : sides) {
      const std::pair<std::array<uint32_t, 2>, uint32_t> back = {{ends[1], ends[0]}, 0};
      const auto other = std::lower_bound(sides.begin(), sides.end(), back);
      if (other == sides.end() || other->first != back.first || other->second <= corner) continue;
      const uint32_t t = corner / 3, k = corner % 3, u = other->second / 3, l = other->second % 3;
      if (u - t > kSteinerWindow) continue;
      const Edge edge = {
          t, u, k, ends[0], ends[1], d_.mesh.triangles[t][(k + 2) % 3], d_.mesh.triangles[u][(l + 2) % 3]};
      if (kLeastWorth <
          worth({edge, 0, {}, to_decoded_[t] + to_decoded_[u], to_original_[t] + to_original_[u]}))
        found.push_back(edge);
    }
    return found;
  }

  std::vector<Split> best_heights() {
    const std::vector<Edge> all = edges();
    std::set<uint32_t> vertices;
    for (const Edge& e : all) vertices.insert({e.a, e.b, e.c, e.d});
    for (uint32_t t = 0; t < d_.mesh.triangles.size(); t++)
      for (uint32_t v : d_.mesh.triangles[t])
        if (vertices.count(v)) fan_[v].push_back(t);
    std::vector<Split> splits(all.size());
    tbb::parallel_for(size_t(0), all.size(), [&](size_t i) {
      const std::vector<uint32_t> ring = ring_of(all[i]);
      for (int32_t height : heights_for(all[i])) {
        const Split s = split(all[i], height, ring);
        if (s.to_decoded > splits[i].to_decoded) splits[i] = s;
      }
    });
    std::erase_if(splits, [](const Split& s) { return s.height == 0; });
    return splits;
  }

  // Those at which samples of the original lie.
  std::vector<int32_t> heights_for(const Edge& e) const {
    const Vec3 a = at(e.a), b = at(e.b), middle = (a + b) / 2;
    const Vec3 normal = (b - a).cross(at(e.c) - at(e.d)).normalized();
    const double unit = (b - a).norm() / kSteinerParts;
    double farthest = 0, most = -1, sum = 0, weight = 0;
    for (uint32_t t : {e.t, e.u})
      for (size_t i = first_sample_[t]; i < first_sample_[t + 1]; i++) {
        const auto& s = samples_.of_original[order_[i]];
        const double height = (s.point - middle).dot(normal);
        if (s.square > most) most = s.square, farthest = height;
        sum += s.square * s.area * height, weight += s.square * s.area;
      }
    std::set<int32_t> heights;
    auto offer = [&](double h) {
      if (std::fabs(h) <= (kSteinerHeights - 1) * unit) heights.insert(int32_t(std::lround(h / unit)));
    };
    if (weight > 0 && unit > 0)
      for (double h :
           {0.7 * farthest, farthest, 1.3 * farthest, 1.7 * farthest, sum / weight, 1.4 * sum / weight})
        offer(h);
    heights.erase(0);
    return {heights.begin(), heights.end()};
  }

  // What becomes of both triangles, with the point at p.
  std::array<Corners, 4> halves(const Edge& e, const Vec3& p) const {
    const Vec3 a = at(e.a), b = at(e.b), c = at(e.c), d = at(e.d);
    return {Corners{a, p, c}, Corners{p, b, c}, Corners{b, p, d}, Corners{p, a, d}};
  }

  // The triangles at an edge's and its triangles' corners, but for those two.
  std::vector<uint32_t> ring_of(const Edge& e) const {
    std::set<uint32_t> ring;
    for (uint32_t v : {e.a, e.b, e.c, e.d})
      for (uint32_t t : fan_.at(v)) ring.insert(t);
    ring.erase(e.t), ring.erase(e.u);
    return {ring.begin(), ring.end()};
  }

  // With this height: what becomes of the original's samples around; nothing if it folds.
  Split split(const Edge& e, int32_t height, const std::vector<uint32_t>& ring) const {
    const Vec3 a = at(e.a), b = at(e.b);
    const Vec3 normal = (b - a).cross(at(e.c) - at(e.d)).normalized();
    Split s = {e, height, (a + b) / 2 + height * (b - a).norm() / kSteinerParts * normal};
    const std::array<Corners, 4> now = halves(e, s.point);
    if (folds(e, now)) return s;
    std::vector<Corners> others;
    for (uint32_t t : ring) others.push_back(corners(t));
    auto nearest = [](const Vec3& p, const auto& list, double least) {
      for (const Corners& t : list) least = std::min(least, squared_distance(p, t[0], t[1], t[2]));
      return least;
    };
    auto look_at = [&](uint32_t t, bool own) {
      for (size_t i = first_sample_[t]; i < first_sample_[t + 1]; i++) {
        const auto& sample = samples_.of_original[order_[i]];
        const double least = own ? nearest(sample.point, others, INFINITY) : sample.square;
        s.to_decoded += (sample.square - nearest(sample.point, now, least)) * sample.area;
      }
    };
    look_at(e.t, true), look_at(e.u, true);
    for (uint32_t t : ring) look_at(t, false);
    return s;
  }

  bool folds(const Edge& e, const std::array<Corners, 4>& now) const {
    std::array<Vec3, 4> normal;
    for (size_t i = 0; i < 4; i++) normal[i] = normal_of(now[i]);
    for (size_t i = 0; i < 4; i++)
      if (!(normal[i].dot(normal[(i + 1) % 4]) > kFold)) return true;
    const uint32_t ring[4][2] = {{e.c, e.a}, {e.b, e.c}, {e.d, e.b}, {e.a, e.d}};  // of the halves, outside
    for (size_t i = 0; i < 4; i++)
      for (uint32_t t : fan_.at(ring[i][0])) {
        const auto& c = d_.mesh.triangles[t];
        for (size_t k = 0; k < 3; k++)
          if (c[k] == ring[i][1] && c[(k + 1) % 3] == ring[i][0] &&
              !(normal[i].dot(normal_of(corners(t))) > kFold))
            return true;
      }
    return false;
  }

  // What becomes of samples of the decoded surface; those that are still worth it.
  std::vector<Split> worth_it(std::vector<Split> splits) const {
    std::vector<Vec3> points;
    std::vector<double> area;
    for (const Split& s : splits)
      for (const Corners& t : halves(s.edge, s.point)) {
        const double part = (t[1] - t[0]).cross(t[2] - t[0]).norm() / 2 / 6;
        for (size_t k = 0; k < 3; k++)
          for (double w : {0.7, 0.1}) {
            points.push_back(w * t[k] + (1 - w) / 2 * (t[(k + 1) % 3] + t[(k + 2) % 3]));
            area.push_back(part);
          }
      }
    if (points.empty()) return {};
    const std::vector<float> distance = in_.distance(points);
    const size_t each = points.size() / splits.size();
    std::vector<Split> kept;
    for (size_t i = 0; i < splits.size(); i++) {
      Split& s = splits[i];
      s.to_original = to_original_[s.edge.t] + to_original_[s.edge.u];
      for (size_t k = i * each; k < (i + 1) * each; k++)
        s.to_original -= double(distance[k]) * distance[k] * area[k];
      if (worth(s) > kLeastWorth) kept.push_back(s);
    }
    return kept;
  }

  const SeamContext& in_;
  const DecodedMesh& d_;
  const size_t first_, end_;  // triangles of gaps
  const MutualSamples samples_;
  std::vector<uint32_t> first_sample_, order_;    // samples of the original, by the triangle that is closest
  std::vector<double> to_decoded_, to_original_;  // of each triangle: integrals of the squared distance
  double sum_to_decoded_ = 0, sum_to_original_ = 0, area_of_original_ = 0, area_of_decoded_ = 0;
  std::map<uint32_t, std::vector<uint32_t>> fan_;  // triangles of vertices at hand
  std::vector<Split> splits_;                      // those that may be worth it
};

}  // namespace

SteinerError add_steiner_points(const SeamContext& in, Attempt& best, bool exactly) {
  const size_t end = best.decoded.mesh.triangles.size() - kTubeTriangles * best.seams.tubes.size();
  if (best.decoded.patch_triangles() >= end) return {};
  const Attempt plain = std::move(best);
  const Splitter splitter(in, plain.decoded, end);
  const auto off = [&](double error) { return std::log(error / in.target); };
  const auto better = [&](double error, double than) {
    return error <= in.target ? than > in.target || error > than : error < than;
  };
  SteinerError least = {INFINITY, false};
  double aim = -kAim, missed = INFINITY, kept = -INFINITY;  // logarithms of what was aimed at over the target
  for (int i = 0; i <= kCorrections; i++) {
    SteinerError now = {0, false};
    Seams seams = plain.seams;
    seams.steiner_points = splitter.choose(in.target * std::exp(aim), now.error);
    Attempt a = attempt(in, std::move(seams));
    a.topology = plain.topology, a.mismatch = plain.mismatch;
    const bool out_of_reach = now.error > in.target;
    const bool known_about = !exactly || in.target == 0 || std::fabs(off(now.error)) > kFar;
    if (!known_about) now = {in.error(a.decoded.mesh), true};
    if (better(now.error, least.error)) best = std::move(a), least = now;
    const double excess = off(now.error);
    if (known_about || out_of_reach || (excess <= 0 && excess > -kContent)) break;
    (excess > 0 ? missed : kept) = aim;
    aim = missed < INFINITY && kept > -INFINITY ? (missed + kept) / 2 : aim - excess - kAim;
  }
  return least;
}

}  // namespace relief
