#include "measure/topology.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "surface/half_edges.h"
#include "surface/sets.h"
#include "surface/weld.h"

namespace relief {
namespace {

Triangles proper_triangles(const TriangleMesh& mesh, bool by_position) {
  Triangles triangles;
  triangles.reserve(mesh.triangles.size());
  std::vector<uint32_t> merged;
  if (by_position) merged = weld_positions(mesh.positions);
  for (std::array<uint32_t, 3> t : mesh.triangles) {
    if (by_position)
      for (uint32_t& v : t) v = merged[v];
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back(t);
  }
  return triangles;
}

Eigen::Vector3d unit_normal(const TriangleMesh& mesh, const std::array<uint32_t, 3>& t) {
  auto at = [&](int k) {
    const auto& p = mesh.positions[t[size_t(k)]];
    return Eigen::Vector3d(p[0], p[1], p[2]);
  };
  Eigen::Vector3d n = (at(1) - at(0)).cross(at(2) - at(0));
  double length = n.norm();
  return length > 0 ? Eigen::Vector3d(n / length) : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

// Pairs half-edges that run opposite ways along an edge of two triangles, and counts the edges of every kind.
std::vector<uint32_t> match_and_count(const TriangleMesh& mesh, const Triangles& triangles, Topology& result,
                                      std::vector<char>& open) {
  std::vector<uint32_t> opposite(triangles.size() * 3, kNoHalfEdge);
  Sets components(triangles.size());
  uint64_t edges = 0;
  for_each_edge(triangles, mesh.positions.size(), [&](std::span<const uint32_t> edge) {
    edges++;
    for (uint32_t h : edge) components.join(edge[0] / 3, h / 3);
    if (edge.size() == 1) {
      result.open_edges++;
      open[edge[0]] = 1;
    } else if (edge.size() == 2 && from_vertex(triangles, edge[0]) != from_vertex(triangles, edge[1])) {
      opposite[edge[0]] = edge[1], opposite[edge[1]] = edge[0];
      Eigen::Vector3d m = unit_normal(mesh, triangles[edge[0] / 3]),
                      n = unit_normal(mesh, triangles[edge[1] / 3]);
      result.flipped += m.dot(n) < kFlippedCosine;
    } else {
      result.nonmanifold_edges++;
    }
  });
  result.components = components.count();
  result.euler = int64_t(result.vertices) - int64_t(edges) + int64_t(triangles.size());
  return opposite;
}

}  // namespace

Topology topology(const TriangleMesh& mesh, bool by_position) {
  Topology result;
  Triangles triangles = proper_triangles(mesh, by_position);
  result.triangles = triangles.size();
  std::vector<char> used(mesh.positions.size(), 0), open(triangles.size() * 3, 0);
  for (const auto& t : triangles)
    for (uint32_t v : t) used[v] = 1;
  result.vertices = uint64_t(std::count(used.begin(), used.end(), 1));

  std::vector<uint32_t> opposite = match_and_count(mesh, triangles, result, open);
  std::vector<char> fans(mesh.positions.size(), 0);  // of a vertex: 0, 1 or more
  label_fans(opposite, [&](uint32_t corner) {
    char& n = fans[from_vertex(triangles, corner)];
    n = char(std::min(n + 1, 2));
  });
  result.nonmanifold_vertices = uint64_t(std::count(fans.begin(), fans.end(), 2));
  // other loops run along non-manifold edges only
  result.boundary_loops = count_loops(opposite, [&](uint32_t h) { return open[h] != 0; });
  bool manifold = result.nonmanifold_edges == 0 && result.nonmanifold_vertices == 0;
  result.genus =
      manifold ? (2 * int64_t(result.components) - result.euler - int64_t(result.boundary_loops)) / 2 : -1;
  return result;
}

}  // namespace relief
