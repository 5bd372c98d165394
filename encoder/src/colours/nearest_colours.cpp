#include "colours/nearest_colours.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <cmath>
#include <optional>

#include "measure/surface_error.h"
#include "points/kd_tree.h"

namespace relief {
namespace {

// A weighted mean in the making.
struct Sum {
  double rgb[3] = {0, 0, 0}, weight = 0;
  void add(const Colour& c, double w) {
    for (size_t k = 0; k < 3; k++) rgb[k] += w * c[k];
    weight += w;
  }
  Colour mean() const {
    Colour c = {0, 0, 0, 255};
    for (size_t k = 0; k < 3; k++) c[k] = uint8_t(std::lround(rgb[k] / weight));
    return c;
  }
};

std::vector<Vec3> points_of(const std::vector<std::array<float, 3>>& positions) {
  std::vector<Vec3> points;
  points.reserve(positions.size());
  for (const auto& p : positions) points.emplace_back(p[0], p[1], p[2]);
  return points;
}

// The share of each corner at the place of a triangle's plane that is nearest to p, cut to the triangle.
Vec3 shares(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a);
  if (!(n.squaredNorm() > 0)) return Vec3::Constant(1.0 / 3);
  Vec3 s((c - b).cross(p - b).dot(n), (a - c).cross(p - c).dot(n), (b - a).cross(p - a).dot(n));
  s = (s / n.squaredNorm()).cwiseMax(0);
  return s / s.sum();
}

void add_from_triangle(const TriangleMesh& input, uint32_t triangle, const Vec3& p, Sum& sum) {
  const auto& t = input.triangles[triangle];
  auto corner = [&](size_t k) {
    const auto& v = input.positions[t[k]];
    return Vec3(v[0], v[1], v[2]);
  };
  const Vec3 share = shares(p, corner(0), corner(1), corner(2));
  for (size_t k = 0; k < 3; k++) sum.add(input.colors[t[k]], share[Eigen::Index(k)]);
}

void add_from_around(const TriangleMesh& cloud, const KdTree& tree, const Vec3& p, Sum& sum) {
  constexpr size_t kAround = 4;
  std::vector<Neighbour> around;
  tree.nearest(p, kAround, around);
  for (const Neighbour& n : around)
    sum.add(cloud.colors[n.index], 1 / (n.squared + 1e-6 * around.back().squared + 1e-300));
}

// Adds every vertex of the input to the position that it is nearest to.
void add_to_nearest(const TriangleMesh& input, const std::vector<Vec3>& vertices,
                    const std::vector<Vec3>& points, std::vector<Sum>& sums) {
  const KdTree tree(points);
  std::vector<uint32_t> nearest(vertices.size());
  tbb::parallel_for(size_t(0), vertices.size(), [&](size_t v) {
    thread_local std::vector<Neighbour> found;
    tree.nearest(vertices[v], 1, found);
    nearest[v] = found[0].index;
  });
  for (size_t v = 0; v < vertices.size(); v++) sums[nearest[v]].add(input.colors[v], 1);
}

}  // namespace

std::vector<Colour> nearest_colours(const TriangleMesh& input,
                                    const std::vector<std::array<float, 3>>& positions) {
  const std::vector<Vec3> points = points_of(positions), vertices = points_of(input.positions);
  std::vector<Sum> sums(points.size());
  add_to_nearest(input, vertices, points, sums);
  std::vector<uint32_t> triangles;
  std::optional<KdTree> tree;
  if (input.triangles.empty())
    tree.emplace(vertices);
  else
    triangles = ErrorMeter(input, 1).closest_triangles(positions);
  std::vector<Colour> colours(points.size());
  tbb::parallel_for(size_t(0), points.size(), [&](size_t i) {
    if (sums[i].weight == 0) {
      if (tree)
        add_from_around(input, *tree, points[i], sums[i]);
      else
        add_from_triangle(input, triangles[i], points[i], sums[i]);
    }
    colours[i] = sums[i].mean();
  });
  return colours;
}

}  // namespace relief
