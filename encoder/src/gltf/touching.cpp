#include "gltf/touching.h"

#include <algorithm>
#include <numeric>

namespace relief {

// The number of the first of all vertices of equal position, for every vertex.
static std::vector<uint32_t> weld(const std::vector<std::array<float, 3>>& positions) {
  std::vector<uint32_t> order(positions.size()), first(positions.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return positions[a] != positions[b] ? positions[a] < positions[b] : a < b;
  });
  for (size_t i = 0; i < order.size(); i++) {
    bool same = i > 0 && positions[order[i]] == positions[order[i - 1]];
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  return first;
}

std::vector<std::array<float, 3>> border_positions(const TriangleMesh& mesh) {
  std::vector<uint32_t> first = weld(mesh.positions);
  std::vector<uint64_t> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles)
    for (size_t k = 0; k < 3; k++) {
      uint32_t a = first[t[k]], b = first[t[(k + 1) % 3]];
      if (a != b) edges.push_back(uint64_t(std::min(a, b)) << 32 | std::max(a, b));
    }
  std::sort(edges.begin(), edges.end());
  std::vector<std::array<float, 3>> border;
  for (size_t i = 0, j = 0; i < edges.size(); i = j) {
    while (j < edges.size() && edges[j] == edges[i]) j++;
    if (j - i != 1) continue;
    for (uint32_t v : {uint32_t(edges[i] >> 32), uint32_t(edges[i])}) {
      std::array<float, 3> p = mesh.positions[v];
      for (float& c : p) c += 0.0f;  // -0 becomes 0
      border.push_back(p);
    }
  }
  std::sort(border.begin(), border.end());
  border.erase(std::unique(border.begin(), border.end()), border.end());
  return border;
}

bool have_common(const std::vector<std::array<float, 3>>& a, const std::vector<std::array<float, 3>>& b) {
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
    if (*i == *j) return true;
    if (*i < *j)
      i++;
    else
      j++;
  }
  return false;
}

}  // namespace relief
