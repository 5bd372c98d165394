#include "surface/border.h"

#include <algorithm>
#include <queue>

#include "surface/sets.h"

namespace relief {
namespace {

// visit(face, a, b) for every edge of one face.
template <class Visit>
void each_border_edge(const Surface& s, Visit visit) {
  for (size_t f = 0; f < s.faces.size(); f++)
    for (size_t k = 0; k < 3; k++)
      if (s.adjacent[f][k] < 0) visit(int(f), s.faces[f][k], s.faces[f][(k + 1) % 3]);
}

// A loop's edges are joined at its vertices: the surface is a manifold.
void find_loops(const Surface& s, double least_radius, SurfaceBorder& border) {
  Sets sets(s.vertices.size());
  each_border_edge(s, [&](int, int a, int b) { sets.join(uint32_t(a), uint32_t(b)); });
  std::vector<SurfaceBorder::Loop> loops;
  std::vector<int> number(s.vertices.size(), -1), edges;
  auto loop_at = [&](int v) -> int& { return number[sets.find(uint32_t(v))]; };
  each_border_edge(s, [&](int f, int a, int) {
    int& loop = loop_at(a);
    if (loop < 0) loop = int(loops.size()), loops.push_back({{0, 0, 0}, 0, f}), edges.push_back(0);
    loops[size_t(loop)].middle += s.vertices[size_t(a)];
    edges[size_t(loop)]++;
  });
  for (size_t l = 0; l < edges.size(); l++) loops[l].middle /= edges[l];
  each_border_edge(s, [&](int, int a, int) {
    SurfaceBorder::Loop& loop = loops[size_t(loop_at(a))];
    loop.radius = std::max(loop.radius, (s.vertices[size_t(a)] - loop.middle).norm());
  });
  std::vector<int> kept(loops.size(), -1);
  for (size_t l = 0; l < loops.size(); l++)
    if (loops[l].radius >= least_radius) kept[l] = int(border.loops.size()), border.loops.push_back(loops[l]);
  each_border_edge(s, [&](int f, int a, int) {
    const int loop = kept[size_t(loop_at(a))];
    if (loop >= 0) border.distance[size_t(f)] = 0, border.loop[size_t(f)] = loop;
  });
}

}  // namespace

SurfaceBorder border_of(const Surface& s, double reach, double least_radius) {
  SurfaceBorder border;
  border.distance.assign(s.faces.size(), INFINITY);
  border.loop.assign(s.faces.size(), -1);
  find_loops(s, least_radius, border);
  if (border.loops.empty()) return {};
  using Entry = std::pair<float, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;  // Dijkstra's algorithm
  for (size_t f = 0; f < s.faces.size(); f++)
    if (border.loop[f] >= 0) queue.push({0, int(f)});
  while (!queue.empty()) {
    const auto [d, f] = queue.top();
    queue.pop();
    if (d > border.distance[size_t(f)]) continue;
    for (int g : s.adjacent[size_t(f)]) {
      if (g < 0) continue;
      const float there = d + float((middle_of(s, g) - middle_of(s, f)).norm());
      if (there > reach || there >= border.distance[size_t(g)]) continue;
      border.distance[size_t(g)] = there, border.loop[size_t(g)] = border.loop[size_t(f)];
      queue.push({there, g});
    }
  }
  return border;
}

}  // namespace relief
