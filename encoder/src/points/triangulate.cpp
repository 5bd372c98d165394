#include "points/triangulate.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace relief {
namespace {

using Vec2 = Eigen::Vector2d;
using Triangle = std::array<uint32_t, 3>;

constexpr double kPi = 3.14159265358979323846;
constexpr double kLargest = 2.5;    // circumradius, spacings: chance leaves gaps of 1.9 among 10^5 points
constexpr size_t kCandidates = 32;  // neighbours for a star
constexpr double kLeastAgreement = 0.1;  // cosine between the normals of neighbours
constexpr double kSteepest = 0.8;        // sine against the tangent plane
constexpr size_t kHoleEdges = 12;        // of holes that are filled
constexpr size_t kUnevenHoleEdges = 24;  // likewise, if the longest is more than a tenth of all

// Triangles that vertices want. A triangle begins with its lowest vertex and keeps its orientation.
struct Wanted {
  Triangle corners;
  float radius;  // of the circumcircle in the plane of who wants it, spacings
  uint8_t votes = 1;
};

Wanted wanted(uint32_t a, uint32_t b, uint32_t c, double radius) {
  Triangle t = {a, b, c};
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return {t, float(radius)};
}

// The place of a neighbour in the tangent plane at a point, at its distance in space: as if the surface were
// unrolled.
struct TangentPlane {
  const Cloud& cloud;
  uint32_t centre;
  Vec3 x, y;
  TangentPlane(const Cloud& c, uint32_t i)
      : cloud(c), centre(i), x(c.normals[i].unitOrthogonal()), y(c.normals[i].cross(x)) {}
  Vec2 flat(uint32_t j) const {
    const Vec3 d = cloud.points[j] - cloud.points[centre];
    return {d.dot(x), d.dot(y)};
  }
  double angle(uint32_t j) const {
    const Vec2 f = flat(j);
    return std::atan2(f.y(), f.x());
  }
};

// A Voronoi cell in the making: a convex polygon around the origin; the edge from a corner belongs to
// `across`.
class VoronoiCell {
 public:
  static constexpr uint32_t kNobody = UINT32_MAX;
  struct Corner {
    Vec2 at;
    uint32_t across;
  };

  explicit VoronoiCell(double radius) {
    constexpr int kSides = 8;
    for (int k = 0; k < kSides; k++) {
      const double a = 2 * kPi * k / kSides;
      corners_.push_back({1.1 * radius * Vec2(std::cos(a), std::sin(a)), kNobody});
    }
  }

  double reach() const {
    double most = 0;
    for (const Corner& c : corners_) most = std::max(most, c.at.squaredNorm());
    return std::sqrt(most);
  }

  // Cuts off what is nearer to `place` than to the origin.
  void cut(const Vec2& place, uint32_t who) {
    const double half = place.squaredNorm() / 2;
    kept_.clear();
    const size_t n = corners_.size();
    for (size_t k = 0; k < n; k++) {
      const Corner &c = corners_[k], &d = corners_[(k + 1) % n];
      const double s = place.dot(c.at) - half, t = place.dot(d.at) - half;
      if (s <= 0) kept_.push_back(c);
      if ((s <= 0) == (t <= 0)) continue;
      // leaving, the border of the new neighbour begins; coming back, that of c's edge goes on
      kept_.push_back({c.at + (d.at - c.at) * (s / (s - t)), s <= 0 ? who : c.across});
    }
    corners_.swap(kept_);
  }

  const std::vector<Corner>& corners() const { return corners_; }

 private:
  std::vector<Corner> corners_, kept_;
};

// The Delaunay triangles around a point in its tangent plane.
void star_of(const Cloud& cloud, const KdTree& tree, uint32_t i, std::vector<Neighbour>& near,
             std::vector<Wanted>& out) {
  const TangentPlane plane(cloud, i);
  const double largest = kLargest * cloud.spacing[i];
  VoronoiCell cell(largest);
  tree.nearest(cloud.points[i], kCandidates, near);
  for (const Neighbour& n : near) {
    const double distance = std::sqrt(n.squared);
    if (n.index == i || distance == 0) continue;
    if (distance > 2 * cell.reach()) break;
    const Vec3 d = cloud.points[n.index] - cloud.points[i];
    if (cloud.normals[n.index].dot(cloud.normals[i]) < kLeastAgreement) continue;
    if (std::fabs(d.dot(cloud.normals[i])) > kSteepest * distance) continue;
    cell.cut(plane.flat(n.index).normalized() * distance, n.index);
  }
  const auto& corners = cell.corners();
  for (size_t k = 0; k < corners.size(); k++) {
    const uint32_t a = corners[(k + corners.size() - 1) % corners.size()].across, b = corners[k].across;
    const double radius = corners[k].at.norm();
    if (a == b || a == VoronoiCell::kNobody || b == VoronoiCell::kNobody || radius > largest) continue;
    out.push_back(wanted(i, a, b, radius / cloud.spacing[i]));
  }
}

std::vector<Wanted> all_stars(const Cloud& cloud, const KdTree& tree) {
  tbb::enumerable_thread_specific<std::vector<Wanted>> local;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, cloud.points.size(), 512), [&](const auto& range) {
    std::vector<Neighbour> near;
    for (size_t i = range.begin(); i < range.end(); i++)
      star_of(cloud, tree, uint32_t(i), near, local.local());
  });
  std::vector<Wanted> all;
  for (const auto& part : local) all.insert(all.end(), part.begin(), part.end());
  tbb::parallel_sort(all.begin(), all.end(), [](const Wanted& a, const Wanted& b) {
    return std::tie(a.corners, a.radius) < std::tie(b.corners, b.radius);
  });
  size_t n = 0;
  for (size_t i = 0; i < all.size(); i++) {
    if (n > 0 && all[n - 1].corners == all[i].corners)
      all[n - 1].votes++, all[n - 1].radius = all[i].radius;  // the largest
    else
      all[n++] = all[i];
  }
  all.resize(n);
  tbb::parallel_sort(all.begin(), all.end(), [](const Wanted& a, const Wanted& b) {
    return std::tie(b.votes, a.radius, a.corners) < std::tie(a.votes, b.radius, b.corners);
  });
  return all;
}

// The triangles so far, as the sector that each takes around its corners.
class Sectors {
 public:
  explicit Sectors(const Cloud& cloud) : cloud_(cloud), at_(cloud.points.size()) {}

  // Adds a triangle if its edges are free and, unless `crowd`, its sectors in the tangent planes as well.
  bool add(const Triangle& t, bool crowd) {
    Sector s[3];
    for (int k = 0; k < 3; k++)
      if (!room(t[k], t[(k + 1) % 3], t[(k + 2) % 3], crowd, s[k])) return false;
    for (int k = 0; k < 3; k++) at_[t[k]].push_back(s[k]);
    triangles_.push_back(t);
    return true;
  }

  // The loops of edges without a triangle on one side, as a triangle there would run through them.
  std::vector<std::vector<uint32_t>> open_loops() const {
    std::vector<std::vector<uint32_t>> loops;
    std::vector<std::vector<uint32_t>> done(at_.size());  // the vertices before each one, in loops
    for (uint32_t start = 0; start < at_.size(); start++)
      for (const Sector& s : at_[start]) {
        if (has_second(start, s.first)) continue;
        std::vector<uint32_t> loop;
        uint32_t from = s.first, v = start;
        while (std::find(done[v].begin(), done[v].end(), from) == done[v].end()) {
          done[v].push_back(from);
          loop.push_back(v);
          const uint32_t next = across_opening(v, from);
          from = v, v = next;
        }
        if (!loop.empty() && v == start && from == s.first) loops.push_back(std::move(loop));
      }
    return loops;
  }

  std::vector<Triangle> take() { return std::move(triangles_); }

 private:
  // Counter-clockwise from vertex `first` to vertex `second`.
  struct Sector {
    uint32_t first, second;
    double from, width;
  };

  static double turn(double angle) { return angle < 0 ? angle + 2 * kPi : angle; }

  bool has_second(uint32_t v, uint32_t a) const {
    return std::any_of(at_[v].begin(), at_[v].end(), [&](const Sector& s) { return s.second == a; });
  }
  bool has_first(uint32_t v, uint32_t a) const {
    return std::any_of(at_[v].begin(), at_[v].end(), [&](const Sector& s) { return s.first == a; });
  }

  bool room(uint32_t v, uint32_t a, uint32_t b, bool crowd, Sector& s) const {
    constexpr double kSlack = 1e-6;
    const TangentPlane plane(cloud_, v);
    s = {a, b, plane.angle(a), 0};
    s.width = turn(plane.angle(b) - s.from);
    if (!crowd && (s.width < kSlack || s.width > kPi - kSlack)) return false;
    for (const Sector& o : at_[v]) {
      if (o.first == a || o.second == b) return false;
      if (crowd) continue;
      if (o.second != a && turn(s.from - o.from) < o.width - kSlack) return false;
      if (o.first != b && turn(o.from - s.from) < s.width - kSlack) return false;
    }
    return true;
  }

  // At v, the opening that begins clockwise of `from`: the vertex at its other side.
  uint32_t across_opening(uint32_t v, uint32_t from) const {
    const TangentPlane plane(cloud_, v);
    const double angle = plane.angle(from);
    uint32_t best = from;
    double least = INFINITY;
    for (const Sector& s : at_[v]) {
      if (has_first(v, s.second)) continue;
      const double back = s.second == from ? 2 * kPi : turn(angle - plane.angle(s.second));
      if (back < least) least = back, best = s.second;
    }
    return best;
  }

  const Cloud& cloud_;
  std::vector<std::vector<Sector>> at_;
  std::vector<Triangle> triangles_;
};

double cosine(const Cloud& c, uint32_t a, uint32_t at, uint32_t b) {
  const Vec3 x = c.points[a] - c.points[at], y = c.points[b] - c.points[at];
  return x.dot(y) / std::max(x.norm() * y.norm(), 1e-300);
}

// Of the angles of a triangle, the cosine of the smallest: the least is best.
double sharpness(const Cloud& c, uint32_t a, uint32_t b, uint32_t d) {
  return std::max({cosine(c, a, b, d), cosine(c, b, d, a), cosine(c, d, a, b)});
}

bool is_small(const Cloud& cloud, const std::vector<uint32_t>& loop) {
  double perimeter = 0, longest = 0;
  for (size_t k = 0; k < loop.size(); k++) {
    const double edge = (cloud.points[loop[k]] - cloud.points[loop[(k + 1) % loop.size()]]).norm();
    perimeter += edge, longest = std::max(longest, edge);
  }
  return loop.size() <= kHoleEdges || (loop.size() <= kUnevenHoleEdges && perimeter <= 10 * longest);
}

// Cuts ears off a hole, the roundest first.
void fill(const Cloud& cloud, Sectors& sectors, std::vector<uint32_t> loop, bool crowd) {
  while (loop.size() >= 3) {
    const size_t n = loop.size();
    std::vector<std::pair<double, size_t>> ears;
    for (size_t k = 0; k < n; k++)
      ears.push_back({sharpness(cloud, loop[(k + n - 1) % n], loop[k], loop[(k + 1) % n]), k});
    std::sort(ears.begin(), ears.end());
    const auto ear = std::find_if(ears.begin(), ears.end(), [&](const auto& e) {
      const size_t k = e.second;
      const Triangle t = {loop[(k + n - 1) % n], loop[k], loop[(k + 1) % n]};
      return t[0] != t[1] && t[1] != t[2] && t[2] != t[0] && sectors.add(t, crowd);
    });
    if (ear == ears.end() || n == 3) return;
    loop.erase(loop.begin() + ptrdiff_t(ear->second));
  }
}

}  // namespace

std::vector<Triangle> triangulate(const Cloud& cloud, const KdTree& tree) {
  Sectors sectors(cloud);
  for (const Wanted& w : all_stars(cloud, tree)) sectors.add(w.corners, false);
  for (bool crowd : {false, true})  // first as the tangent planes want it, then as best one can
    for (const auto& loop : sectors.open_loops())
      if (is_small(cloud, loop)) fill(cloud, sectors, loop, crowd);
  return sectors.take();
}

}  // namespace relief
