#include "seams/folds.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "measure/topology.h"
#include "surface/half_edges.h"

namespace relief {
namespace {

std::array<int64_t, 3> cell_at(const Vec3& p, double size) {
  return {int64_t(std::floor(p.x() / size)), int64_t(std::floor(p.y() / size)),
          int64_t(std::floor(p.z() / size))};
}

uint64_t key_of(int64_t x, int64_t y, int64_t z) {
  return (uint64_t(x) & 0x1fffff) << 42 | (uint64_t(y) & 0x1fffff) << 21 | (uint64_t(z) & 0x1fffff);
}

uint64_t edge_key(uint32_t from, uint32_t to) { return uint64_t(from) << 32 | to; }

}  // namespace

Vec3 unit_normal(const DecodedMesh& d, const Ground& g, size_t triangle) {
  const auto& [a, b, c] = d.mesh.triangles[triangle];
  const Vec3 p = g.lattice(d.mesh.positions[a]);
  const Vec3 n = (g.lattice(d.mesh.positions[b]) - p).cross(g.lattice(d.mesh.positions[c]) - p);
  return n.squaredNorm() > 0 ? Vec3(n.normalized()) : n;
}

std::vector<Vec3> folded_vertices(const Surface& s) {
  std::vector<Vec3> folded;
  for (size_t f = 0; f < s.faces.size(); f++)
    for (size_t k = 0; k < 3; k++) {
      const int g = s.adjacent[f][k];
      if (g <= int(f) || s.normals[f].dot(s.normals[size_t(g)]) >= kFlippedCosine) continue;
      for (size_t end : {k, (k + 1) % 3}) folded.push_back(s.vertices[size_t(s.faces[f][end])]);
    }
  return folded;
}

FoldFinder::FoldFinder(const DecodedMesh& decoded, const Ground& ground, const std::vector<Vec3>& folded)
    : ground_(ground) {
  if (ground.spacing.empty()) return;
  cell_ = *std::min_element(ground.spacing.begin(), ground.spacing.end()) / 2;
  for (const Vec3& p : folded) add_surface_fold(p);
  std::vector<char> on_border(decoded.mesh.positions.size(), 0);
  for (uint32_t v : decoded.nodes) on_border[v] = 1;
  for (uint32_t t = 0; t < decoded.patch_triangles(); t++)
    for (size_t k = 0; k < 3; k++) {
      const uint32_t a = decoded.mesh.triangles[t][k], b = decoded.mesh.triangles[t][(k + 1) % 3];
      if (on_border[a] && on_border[b]) border_[edge_key(a, b)] = t;
    }
}

void FoldFinder::add_surface_fold(const Vec3& p) {
  const auto [x, y, z] = cell_at(p, cell_);
  for (int64_t dx = -1; dx <= 1; dx++)
    for (int64_t dy = -1; dy <= 1; dy++)
      for (int64_t dz = -1; dz <= 1; dz++) surface_.insert(key_of(x + dx, y + dy, z + dz));
}

bool FoldFinder::in_surface(const Vec3& p) const {
  const auto [x, y, z] = cell_at(p, cell_);
  return surface_.count(key_of(x, y, z)) > 0;
}

std::vector<Fold> FoldFinder::find(const DecodedMesh& d) const {
  std::vector<Fold> folds;
  const uint32_t first = uint32_t(d.patch_triangles());
  const Triangles between(d.mesh.triangles.begin() + first, d.mesh.triangles.end());
  for_each_edge(between, d.mesh.positions.size(), [&](std::span<const uint32_t> edge) {
    const uint32_t from = from_vertex(between, edge[0]), to = to_vertex(between, edge[0]);
    const uint32_t t = first + edge[0] / 3;
    uint32_t u;
    if (edge.size() == 1) {
      const auto beyond = border_.find(edge_key(to, from));
      if (beyond == border_.end()) return;
      u = beyond->second;
    } else {
      u = first + edge[1] / 3;
    }
    if (unit_normal(d, ground_, t).dot(unit_normal(d, ground_, u)) >= kFlippedCosine) return;
    if (!in_surface(ground_.lattice(d.mesh.positions[from]))) folds.push_back({{t, u}, {from, to}});
  });
  return folds;
}

}  // namespace relief
