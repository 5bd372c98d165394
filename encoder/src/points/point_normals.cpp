#include "points/point_normals.h"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "surface/sets.h"

namespace relief {
namespace {

struct Edge {
  float weight;
  uint32_t a, b;
};

// Neighbours that are near, and as such in each other's tangent planes: the sheet across a narrow gap lies
// along the normal.
std::vector<Edge> neighbourhood_graph(const KdTree& tree, const std::vector<Vec3>& normals) {
  const size_t count = normals.size();
  std::vector<Edge> edges(count * kNeighbours, {INFINITY, 0, 0});
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, 256), [&](const auto& range) {
    std::vector<Neighbour> near;
    for (size_t i = range.begin(); i < range.end(); i++) {
      tree.nearest(tree.points()[i], kNeighbours + 1, near);
      for (size_t k = 0, slot = i * kNeighbours; k < near.size() && slot < (i + 1) * kNeighbours; k++) {
        const size_t j = near[k].index;
        if (j == i) continue;
        const Vec3 d = tree.points()[j] - tree.points()[i];
        const double away = std::max(std::fabs(d.dot(normals[i])), std::fabs(d.dot(normals[j])));
        const double length = std::max(d.norm(), 1e-300);
        const double weight = 1 - std::fabs(normals[i].dot(normals[j])) + away / length;
        edges[slot++] = {float(weight), uint32_t(i), uint32_t(j)};
      }
    }
  });
  std::erase_if(edges, [](const Edge& e) { return e.weight == INFINITY; });
  return edges;
}

// Kruskal 1956.
std::vector<Edge> spanning_forest(size_t count, std::vector<Edge> edges) {
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.weight, a.a, a.b) < std::tie(b.weight, b.a, b.b);
  });
  Sets sets(count);
  std::vector<Edge> forest;
  for (const Edge& e : edges)
    if (sets.find(e.a) != sets.find(e.b)) sets.join(e.a, e.b), forest.push_back(e);
  return forest;
}

// Both ways, as compressed rows.
struct Rows {
  std::vector<uint32_t> begin, to;
};

Rows rows_of(size_t count, const std::vector<Edge>& edges) {
  Rows rows{std::vector<uint32_t>(count + 1, 0), std::vector<uint32_t>(2 * edges.size())};
  for (const Edge& e : edges) rows.begin[e.a + 1]++, rows.begin[e.b + 1]++;
  std::partial_sum(rows.begin.begin(), rows.begin.end(), rows.begin.begin());
  std::vector<uint32_t> next(rows.begin.begin(), rows.begin.end() - 1);
  for (const Edge& e : edges) rows.to[next[e.a]++] = e.b, rows.to[next[e.b]++] = e.a;
  return rows;
}

struct Plane {
  Vec3 normal;
  double thickness;  // rms distance of the points from it, over the radius
  double flatness;   // squared, over that along the shorter axis of the plane; the less the better
};

Plane plane_of(const KdTree& tree, const Vec3& p, double radius, std::vector<Neighbour>& near) {
  constexpr size_t kFewest = 6;
  tree.within(p, radius, near);
  if (near.size() < kFewest) {
    tree.nearest(p, kFewest, near);
    radius = std::max(radius, std::sqrt(near.back().squared));
  }
  Vec3 mean = Vec3::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double sum = 0;
  for (const Neighbour& n : near) {
    const Vec3 d = (tree.points()[n.index] - p) / radius;
    const double w = std::exp(-2 * d.squaredNorm());
    mean += w * d, covariance += w * d * d.transpose(), sum += w;
  }
  mean /= sum, covariance = covariance / sum - mean * mean.transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(covariance);
  Vec3 normal = solver.eigenvectors().col(0);
  if (!(std::fabs(normal.norm() - 1) < 1e-6)) normal = Vec3::UnitZ();
  const Vec3 axes = solver.eigenvalues().cwiseMax(0.0);
  return {normal, std::sqrt(axes[0]), axes[0] / std::max(axes[1], 1e-12)};
}

// The normal at the scale at which the points look most like a plane: at thin parts, a closer look.
Vec3 flattest(const KdTree& tree, const Vec3& p, double radius, std::vector<Neighbour>& near) {
  constexpr size_t kEnough = 8;
  Plane best = plane_of(tree, p, radius, near);
  for (double closer : {0.8, 0.6}) {
    const Plane plane = plane_of(tree, p, closer * radius, near);
    if (near.size() >= kEnough && plane.flatness < best.flatness) best = plane;
  }
  return best.normal;
}

}  // namespace

std::vector<Vec3> plane_normals(const KdTree& tree, const std::vector<double>& radius) {
  std::vector<Vec3> normals(tree.points().size());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, normals.size(), 64), [&](const auto& range) {
    std::vector<Neighbour> near;
    for (size_t i = range.begin(); i < range.end(); i++)
      normals[i] = flattest(tree, tree.points()[i], radius[i], near);
  });
  return normals;
}

double plane_thickness(const KdTree& tree, size_t i, double radius) {
  std::vector<Neighbour> near;
  return plane_of(tree, tree.points()[i], radius, near).thickness;
}

size_t orient_normals(const KdTree& tree, std::vector<Vec3>& normals) {
  const size_t count = normals.size();
  const Rows rows = rows_of(count, spanning_forest(count, neighbourhood_graph(tree, normals)));
  std::vector<uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    const double za = tree.points()[a].z(), zb = tree.points()[b].z();
    return za > zb || (za == zb && a < b);
  });
  std::vector<char> seen(count, 0);
  std::vector<uint32_t> stack;
  size_t parts = 0;
  for (uint32_t top : order) {
    if (seen[top]) continue;
    parts++;
    seen[top] = 1;
    if (normals[top].z() < 0) normals[top] = -normals[top];
    stack.assign(1, top);
    while (!stack.empty()) {
      const uint32_t i = stack.back();
      stack.pop_back();
      for (uint32_t k = rows.begin[i]; k < rows.begin[i + 1]; k++) {
        const uint32_t j = rows.to[k];
        if (seen[j]) continue;
        seen[j] = 1;
        if (normals[i].dot(normals[j]) < 0) normals[j] = -normals[j];
        stack.push_back(j);
      }
    }
  }
  return parts;
}

}  // namespace relief
