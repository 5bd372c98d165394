// Half-edges of a triangle list: half-edge 3f + k runs from corner k to corner k + 1 of triangle f.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace relief {

constexpr uint32_t kNoHalfEdge = 0xffffffffu;

using Triangles = std::vector<std::array<uint32_t, 3>>;

inline uint32_t next_half_edge(uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
inline uint32_t previous_half_edge(uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }
inline uint32_t from_vertex(const Triangles& t, uint32_t h) { return t[h / 3][h % 3]; }
inline uint32_t to_vertex(const Triangles& t, uint32_t h) { return from_vertex(t, next_half_edge(h)); }

// Calls visit(std::span<const uint32_t> half_edges) for every undirected edge, with its half-edges in rising
// order. Buckets by the lower vertex, then sorts each bucket: linear but for vertices of very many edges.
template <class Visit>
void for_each_edge(const Triangles& triangles, size_t vertex_count, Visit visit) {
  std::vector<uint32_t> end(vertex_count + 1, 0);
  uint32_t count = uint32_t(triangles.size() * 3);
  auto low = [&](uint32_t h) { return std::min(from_vertex(triangles, h), to_vertex(triangles, h)); };
  auto high = [&](uint32_t h) { return std::max(from_vertex(triangles, h), to_vertex(triangles, h)); };
  for (uint32_t h = 0; h < count; h++) end[low(h) + 1]++;
  for (size_t v = 0; v < vertex_count; v++) end[v + 1] += end[v];
  std::vector<std::pair<uint32_t, uint32_t>> edges(count);  // higher vertex, half-edge
  std::vector<uint32_t> at(end.begin(), end.end() - 1);
  for (uint32_t h = 0; h < count; h++) edges[at[low(h)]++] = {high(h), h};
  std::vector<uint32_t> group;
  for (size_t v = 0; v < vertex_count; v++) {
    std::sort(edges.begin() + end[v], edges.begin() + end[v + 1]);
    for (uint32_t i = end[v]; i < end[v + 1];) {
      group.clear();
      for (uint32_t other = edges[i].first; i < end[v + 1] && edges[i].first == other; i++)
        group.push_back(edges[i].second);
      visit(std::span<const uint32_t>(group));
    }
  }
}

// Numbers the fans of corners that are connected through matched edges around their vertex. `opposite` holds
// the other half-edge of each matched edge, running the other way, or kNoHalfEdge. Calls start(corner) for
// the first corner of each fan; the corner of half-edge h is the one it starts from. Returns the fan of each
// corner.
template <class Start>
std::vector<uint32_t> label_fans(const std::vector<uint32_t>& opposite, Start start) {
  std::vector<uint32_t> fan(opposite.size(), kNoHalfEdge);
  uint32_t count = 0;
  for (uint32_t h = 0; h < fan.size(); h++) {
    if (fan[h] != kNoHalfEdge) continue;
    start(h);
    uint32_t c = h;
    do {  // counter-clockwise, across the edge that comes in
      fan[c] = count;
      c = opposite[previous_half_edge(c)];
    } while (c != kNoHalfEdge && c != h);
    if (c == kNoHalfEdge)  // an open fan: clockwise from the start, across the edge that goes out
      for (uint32_t o = opposite[h]; o != kNoHalfEdge; o = opposite[c]) fan[c = next_half_edge(o)] = count;
    count++;
  }
  return fan;
}

// Walks along the edges without an opposite: from the end of one, around the fan to the next. Counts closed
// walks that begin at a half-edge which is one of `is_open`.
template <class IsOpen>
uint64_t count_loops(const std::vector<uint32_t>& opposite, IsOpen is_open) {
  std::vector<char> seen(opposite.size(), 0);
  uint64_t loops = 0;
  for (uint32_t start = 0; start < opposite.size(); start++) {
    if (!is_open(start) || seen[start]) continue;
    loops++;
    for (uint32_t h = start; !seen[h];) {
      seen[h] = 1;
      for (h = next_half_edge(h); opposite[h] != kNoHalfEdge;) h = next_half_edge(opposite[h]);
    }
  }
  return loops;
}

}  // namespace relief
