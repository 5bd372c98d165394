#include "seams/holes.h"

#include <algorithm>

namespace relief {
namespace {

constexpr double kNear = 3;           // grid spacings from the border
constexpr double kAlongBorder = 0.4;  // of a hole's nodes

void find_nodes(const DecodedMesh& d, size_t face, size_t pixels, std::vector<uint32_t>& nodes) {
  nodes.clear();
  for (size_t t = d.first_triangle[face]; t < d.face_end(face); t++)
    for (uint32_t v : d.mesh.triangles[t])
      if (v < pixels) nodes.push_back(v);
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
}

// The loop that most nodes are near, and how many are.
std::pair<int, size_t> nearest_loop(const std::vector<uint32_t>& nodes, const Ground& ground,
                                    const SurfaceBorder& border, std::vector<int>& loops) {
  loops.clear();
  for (uint32_t v : nodes) {
    const int f = ground.face[v];
    if (f >= 0 && border.distance[size_t(f)] <= kNear * ground.spacing[v])
      loops.push_back(border.loop[size_t(f)]);
  }
  std::sort(loops.begin(), loops.end());
  std::pair<int, size_t> best = {-1, 0};
  for (size_t i = 0, j; i < loops.size(); i = j) {
    for (j = i; j < loops.size() && loops[j] == loops[i];) j++;
    if (j - i > best.second) best = {loops[i], j - i};
  }
  return best;
}

}  // namespace

std::vector<HoleFace> faces_along_border(const DecodedMesh& d, const Ground& ground,
                                         const SurfaceBorder& border, const GapError& error, double spacing) {
  std::vector<HoleFace> found;
  std::vector<uint32_t> nodes;
  std::vector<int> loops;
  for (uint32_t f = 0; f < d.first_triangle.size(); f++) {
    find_nodes(d, f, ground.pixel.size(), nodes);
    const auto [loop, near] = nearest_loop(nodes, ground, border, loops);
    if (near == 0 || double(near) < kAlongBorder * double(nodes.size())) continue;
    float furthest = 0;
    for (size_t t = d.first_triangle[f]; t < d.face_end(f); t++)
      furthest = std::max(furthest, error.triangle[t - d.patch_triangles()].middle);
    found.push_back({f, loop, double(near) / double(nodes.size()), float(furthest / spacing)});
  }
  return found;
}

}  // namespace relief
