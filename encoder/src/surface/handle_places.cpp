#include "surface/handle_places.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "surface/half_edges.h"
#include "surface/sets.h"

namespace relief {
namespace {

constexpr size_t kLargestBall = 8192;                // vertices
constexpr double kFirstRadius = 1.5, kGrowth = 1.5;  // the first in mean edges

struct Edges {
  std::vector<uint32_t> opposite;           // half-edge of each half-edge, or kNoHalfEdge
  std::vector<uint32_t> begin, half_edges;  // those that leave each vertex
};

uint32_t from(const Surface& s, uint32_t h) { return uint32_t(s.faces[h / 3][h % 3]); }
uint32_t to(const Surface& s, uint32_t h) { return from(s, next_half_edge(h)); }

Edges edges_of(const Surface& s) {
  Edges e;
  const uint32_t count = uint32_t(3 * s.faces.size());
  e.opposite.assign(count, kNoHalfEdge);
  e.begin.assign(s.vertices.size() + 1, 0);
  for (uint32_t h = 0; h < count; h++) {
    e.begin[from(s, h) + 1]++;
    const int across = s.adjacent[h / 3][h % 3];
    for (uint32_t k = 0; across >= 0 && k < 3; k++)
      if (from(s, 3 * uint32_t(across) + k) == to(s, h)) e.opposite[h] = 3 * uint32_t(across) + k;
  }
  for (size_t v = 0; v < s.vertices.size(); v++) e.begin[v + 1] += e.begin[v];
  e.half_edges.resize(count);
  std::vector<uint32_t> at(e.begin.begin(), e.begin.end() - 1);
  for (uint32_t h = 0; h < count; h++) e.half_edges[at[from(s, h)]++] = h;
  return e;
}

// Calls visit(half-edge, vertex) for the edges at v. One on the border has a half-edge at one end only.
template <class Visit>
void for_each_neighbour(const Surface& s, const Edges& e, uint32_t v, Visit visit) {
  for (uint32_t i = e.begin[v]; i < e.begin[v + 1]; i++) {
    const uint32_t h = e.half_edges[i], before = previous_half_edge(h);
    visit(h, to(s, h));
    if (e.opposite[before] == kNoHalfEdge) visit(before, from(s, before));
  }
}

// Steps from the first vertex of each component, and the edges of that tree, marked by either half-edge.
std::vector<uint32_t> breadth_first(const Surface& s, const Edges& e, std::vector<char>& in_tree) {
  std::vector<uint32_t> depth(s.vertices.size(), UINT32_MAX), queue;
  for (uint32_t first = 0; first < s.vertices.size(); first++) {
    if (depth[first] != UINT32_MAX) continue;
    depth[first] = 0;
    queue.assign(1, first);
    for (size_t i = 0; i < queue.size(); i++)
      for_each_neighbour(s, e, queue[i], [&](uint32_t h, uint32_t v) {
        if (depth[v] != UINT32_MAX) return;
        depth[v] = depth[queue[i]] + 1;
        queue.push_back(v);
        in_tree[h] = 1;
        if (e.opposite[h] != kNoHalfEdge) in_tree[e.opposite[h]] = 1;
      });
  }
  return depth;
}

// The edges, two a handle, that are in neither tree. Border loops count as faces.
std::vector<uint32_t> edges_left_over(const Surface& s, const Edges& e) {
  std::vector<char> in_tree(e.opposite.size(), 0);
  const std::vector<uint32_t> depth = breadth_first(s, e, in_tree);
  const uint32_t faces = uint32_t(s.faces.size());
  Sets joined(faces + s.vertices.size());  // faces, then the loops, by all vertices along them
  std::vector<uint32_t> rest;
  for (uint32_t h = 0; h < e.opposite.size(); h++) {
    if (e.opposite[h] == kNoHalfEdge) joined.join(faces + from(s, h), faces + to(s, h));
    if (!in_tree[h] && (e.opposite[h] == kNoHalfEdge || h < e.opposite[h])) rest.push_back(h);
  }
  auto length = [&](uint32_t h) { return depth[from(s, h)] + depth[to(s, h)]; };
  std::stable_sort(rest.begin(), rest.end(), [&](uint32_t a, uint32_t b) { return length(a) > length(b); });
  std::erase_if(rest, [&](uint32_t h) {
    const uint32_t o = e.opposite[h], a = h / 3, b = o == kNoHalfEdge ? faces + from(s, h) : o / 3;
    if (joined.find(a) == joined.find(b)) return false;
    joined.join(a, b);
    return true;
  });
  return rest;
}

// Balls about edges, along the surface.
class Balls {
 public:
  Balls(const Surface& s, const Edges& e)
      : s_(s), e_(e), distance_(s.vertices.size(), INFINITY), number_(s.faces.size(), UINT32_MAX) {
    mean_edge_ = std::sqrt(s.total_area / double(std::max<size_t>(1, s.vertices.size())));
  }

  // The radius of the smallest that has a handle.
  double radius_with_handle(uint32_t h) {
    reach(from(s_, h), 0), reach(to(s_, h), 0);
    double r = kFirstRadius * mean_edge_;
    while (grow(r) && genus(r) < 1) r *= kGrowth;
    for (uint32_t v : touched_) distance_[v] = INFINITY;
    touched_.clear(), ball_.clear();
    queue_ = {};
    return r;
  }

 private:
  void reach(uint32_t v, double d) {
    if (d >= distance_[v]) return;
    if (distance_[v] == INFINITY) touched_.push_back(v);
    distance_[v] = d;
    queue_.push({d, v});
  }

  // Adds the vertices up to a distance to the ball (Dijkstra 1959). False: they are too many, or all there
  // are.
  bool grow(double r) {
    while (!queue_.empty() && queue_.top().first <= r) {
      const auto [d, v] = queue_.top();
      queue_.pop();
      if (d > distance_[v]) continue;
      if (ball_.size() == kLargestBall) return false;
      ball_.push_back(v);
      for_each_neighbour(s_, e_, v, [&, v = v, d = d](uint32_t, uint32_t u) {
        reach(u, d + (s_.vertices[u] - s_.vertices[v]).norm());
      });
    }
    return !queue_.empty();
  }

  // The faces of which all corners are within r.
  void gather_faces(double r) {
    faces_.clear();
    auto within = [&](int v) { return distance_[size_t(v)] <= r; };
    for (uint32_t v : ball_)
      for (uint32_t i = e_.begin[v]; i < e_.begin[v + 1]; i++) {
        const uint32_t f = e_.half_edges[i] / 3;
        const auto& [a, b, c] = s_.faces[f];
        if (number_[f] != UINT32_MAX || !within(a) || !within(b) || !within(c)) continue;
        number_[f] = uint32_t(faces_.size());
        faces_.push_back(f);
      }
  }

  // Of the faces within r, split where they touch in a vertex only.
  int64_t genus(double r) {
    gather_faces(r);
    std::vector<uint32_t> opposite(3 * faces_.size(), kNoHalfEdge);
    Sets pieces(faces_.size());
    int64_t border = 0, vertices = 0;
    for (uint32_t h = 0; h < opposite.size(); h++) {
      const uint32_t o = e_.opposite[3 * faces_[h / 3] + h % 3];
      const uint32_t n = o == kNoHalfEdge ? UINT32_MAX : number_[o / 3];
      if (n == UINT32_MAX)
        border++;
      else
        opposite[h] = 3 * n + o % 3, pieces.join(h / 3, n);
    }
    label_fans(opposite, [&](uint32_t) { vertices++; });
    const auto loops = int64_t(count_loops(opposite, [&](uint32_t h) { return opposite[h] == kNoHalfEdge; }));
    for (uint32_t f : faces_) number_[f] = UINT32_MAX;
    const int64_t faces = int64_t(faces_.size()), edges = (3 * faces + border) / 2;
    return (2 * int64_t(pieces.count()) - (vertices - edges + faces) - loops) / 2;
  }

  const Surface& s_;
  const Edges& e_;
  double mean_edge_;
  using Entry = std::pair<double, uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
  std::vector<uint32_t> ball_, touched_, faces_;
  std::vector<double> distance_;  // of vertices that are touched
  std::vector<uint32_t> number_;  // of faces in it
};

}  // namespace

std::vector<HandlePlace> handle_places(const Surface& s) {
  const Edges e = edges_of(s);
  Balls balls(s, e);
  std::vector<HandlePlace> edges;
  for (uint32_t h : edges_left_over(s, e))
    edges.push_back({(s.vertices[from(s, h)] + s.vertices[to(s, h)]) / 2, balls.radius_with_handle(h)});
  std::stable_sort(edges.begin(), edges.end(),
                   [](const HandlePlace& a, const HandlePlace& b) { return a.radius < b.radius; });
  // the one nearest to the smallest is taken for the other of its handle
  std::vector<HandlePlace> places;
  while (!edges.empty()) {
    places.push_back(edges.front());
    edges.erase(edges.begin());
    if (edges.empty()) break;
    edges.erase(std::min_element(edges.begin(), edges.end(), [&](const HandlePlace& a, const HandlePlace& b) {
      return (a.middle - places.back().middle).squaredNorm() <
             (b.middle - places.back().middle).squaredNorm();
    }));
  }
  return places;
}

}  // namespace relief
