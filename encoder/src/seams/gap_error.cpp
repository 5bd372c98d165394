#include "seams/gap_error.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "measure/closest_point.h"
#include "seams/keys.h"

namespace relief {
namespace {

constexpr double kLong = 3;  // spacings; an edge of a triangle that is looked at in more than one point

uint64_t key_of_triangle(const TriangleMesh& m, size_t t) {
  uint64_t key = 0;  // the order of the corners does not matter
  for (uint32_t v : m.triangles[t]) key += key_of(m.positions[v]);
  return key;
}

std::array<Vec3, 3> corners(const DecodedMesh& d, const Ground& ground, size_t t) {
  std::array<Vec3, 3> p;
  for (size_t k = 0; k < 3; k++) p[k] = ground.lattice(d.mesh.positions[d.mesh.triangles[t][k]]);
  return p;
}

double longest_edge(const std::array<Vec3, 3>& p) {
  return std::max({(p[1] - p[0]).norm(), (p[2] - p[1]).norm(), (p[0] - p[2]).norm()});
}

// Finds triangles by their keys among those of a mesh that is much the same, in much the same order.
class Follower {
 public:
  explicit Follower(const std::vector<GapTriangle>& list) : list_(list) {}
  const GapTriangle* find(uint64_t key) {
    constexpr size_t kAhead = 64;
    for (size_t i = at_; i < std::min(list_.size(), at_ + kAhead); i++)
      if (list_[i].key == key) {
        at_ = i + 1;
        return &list_[i];
      }
    return nullptr;
  }

 private:
  const std::vector<GapTriangle>& list_;
  size_t at_ = 0;
};

// All triangles are looked at in their middles; long ones err as the middles of their edges do.
void measure_unknown(const DecodedMesh& decoded, const Ground& ground, const std::vector<size_t>& unknown,
                     const DistanceToSurface& distance, double spacing, GapError& g, KnownTriangles& known) {
  std::vector<Vec3> points;
  std::vector<size_t> middle;  // where each one's is; its edges' follow if it is long
  for (size_t t : unknown) {
    const std::array<Vec3, 3> p = corners(decoded, ground, decoded.patch_triangles() + t);
    g.triangle[t].area = (p[1] - p[0]).cross(p[2] - p[0]).norm() / 2;
    middle.push_back(points.size());
    points.push_back((p[0] + p[1] + p[2]) / 3);
    if (longest_edge(p) <= kLong * spacing) continue;
    for (size_t k = 0; k < 3; k++) points.push_back((p[k] + p[(k + 1) % 3]) / 2);
  }
  if (points.empty()) return;
  const std::vector<float> d = distance(points);
  middle.push_back(points.size());
  for (size_t i = 0; i < unknown.size(); i++) {
    GapTriangle& t = g.triangle[unknown[i]];
    const size_t first = middle[i], next = middle[i + 1];
    t.middle = d[first];
    if (next == first + 1) t.squared = d[first] * d[first];
    for (size_t k = first + 1; k < next; k++) t.squared += 1 / 3.0f * d[k] * d[k];
    known[t.key] = t;
  }
}

// A triangle in a ball, which tells of most that they are too far away.
struct Placed {
  std::array<Vec3, 3> corner;
  Vec3 middle;
  double radius;
};

Placed placed(const std::array<Vec3, 3>& p) {
  const Vec3 middle = (p[0] + p[1] + p[2]) / 3;
  return {p, middle, std::max({(p[0] - middle).norm(), (p[1] - middle).norm(), (p[2] - middle).norm()})};
}

// Those of `x` that are not in `y`.
std::vector<size_t> only_in(const std::vector<GapTriangle>& x, const std::vector<GapTriangle>& y) {
  auto same = [](const GapTriangle& a, const GapTriangle& b) { return a.key == b.key; };
  const auto first = std::mismatch(x.begin(), x.end(), y.begin(), y.end(), same);
  const auto last = std::mismatch(x.rbegin(), std::make_reverse_iterator(first.first), y.rbegin(),
                                  std::make_reverse_iterator(first.second), same);
  std::unordered_set<uint64_t> keys;
  for (auto t = first.second; t != last.second.base(); ++t) keys.insert(t->key);
  std::vector<size_t> found;
  for (auto t = first.first; t != last.first.base(); ++t)
    if (!keys.count(t->key)) found.push_back(size_t(t - x.begin()));
  return found;
}

}  // namespace

GapError gap_error(const DecodedMesh& decoded, const Ground& ground, const DistanceToSurface& distance,
                   double spacing, const GapError& like, KnownTriangles& known) {
  GapError g;
  const size_t first = decoded.patch_triangles();
  std::vector<size_t> unknown;
  Follower follower(like.triangle);
  for (size_t t = first; t < decoded.mesh.triangles.size(); t++) {
    const uint64_t key = key_of_triangle(decoded.mesh, t);
    const GapTriangle* found = follower.find(key);
    if (const auto at = found ? known.end() : known.find(key); at != known.end()) found = &at->second;
    if (!found) unknown.push_back(t - first);
    g.triangle.push_back(found ? *found : GapTriangle{key, 0, 0, 0});
  }
  measure_unknown(decoded, ground, unknown, distance, spacing, g, known);
  g.of_face.assign(decoded.first_triangle.size(), 0);
  for (size_t f = 0; f < g.of_face.size(); f++) {
    for (size_t t = decoded.first_triangle[f]; t < decoded.face_end(f); t++)
      g.of_face[f] += double(g.triangle[t - first].squared) * g.triangle[t - first].area;
    g.sum += g.of_face[f];
  }
  return g;
}

double laid_bare(const DecodedMesh& before, const GapError& error_before, const DecodedMesh& after,
                 const GapError& error_after, const Ground& ground) {
  std::vector<Placed> added;
  for (size_t t : only_in(error_after.triangle, error_before.triangle))
    added.push_back(placed(corners(after, ground, after.patch_triangles() + t)));
  double sum = 0;
  for (size_t t : only_in(error_before.triangle, error_after.triangle)) {
    const std::array<Vec3, 3> p = corners(before, ground, before.patch_triangles() + t);
    const GapTriangle& old = error_before.triangle[t];
    const Vec3 middle = (p[0] + p[1] + p[2]) / 3;
    for (const Vec3& q :
         {middle, Vec3((middle + p[0]) / 2), Vec3((middle + p[1]) / 2), Vec3((middle + p[2]) / 2)}) {
      double least = INFINITY;  // the corners are still there
      for (const Vec3& v : p) least = std::min(least, (v - q).norm());
      for (const auto& [c, centre, radius] : added)
        if ((centre - q).norm() < least + radius)
          least = std::min(least, std::sqrt(squared_distance(q, c[0], c[1], c[2])));
      // the surface is only about where the triangle was
      const double away = std::max(0.0, least - 2 * std::sqrt(double(old.squared)));
      sum += away * away * old.area / 4;
    }
  }
  return sum;
}

}  // namespace relief
