#include "surface/surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>

#include "surface/half_edges.h"
#include "surface/weld.h"

namespace relief {
namespace {

// The surface in the making.
struct Faces {
  Triangles triangles;
  std::vector<int> source;                     // the input's triangle of each
  std::vector<uint32_t> opposite;              // of each half-edge: the other one of its edge, or kNoHalfEdge
  std::vector<std::vector<uint32_t>> crowded;  // the half-edges of each edge of three or more triangles
};

void warn(std::vector<std::string>& warnings, const char* verb, size_t count, const char* one,
          const char* many) {
  if (count > 0)
    warnings.push_back(std::string(verb) + " " + std::to_string(count) + " " + (count > 1 ? many : one));
}

void check_input(const TriangleMesh& mesh) {
  if (mesh.positions.empty()) throw InputError("has no vertices");
  if (mesh.triangles.empty()) throw InputError("has no faces");
  if (mesh.triangles.size() > size_t(std::numeric_limits<int>::max()) / 3 ||
      mesh.positions.size() > size_t(std::numeric_limits<int>::max()))
    throw InputError("has more than 2^31 half-edges or vertices");
  for (size_t i = 0; i < mesh.positions.size(); i++)
    for (float c : mesh.positions[i])
      if (!std::isfinite(c))
        throw InputError("vertex " + std::to_string(i) + " has a coordinate that is not finite");
  for (size_t i = 0; i < mesh.triangles.size(); i++)
    for (uint32_t v : mesh.triangles[i])
      if (v >= mesh.positions.size())
        throw InputError("face " + std::to_string(i) + ": vertex index " + std::to_string(v) +
                         " is out of range");
}

// Whether a triangle has been seen before, its vertices in any order.
class TriangleSet {
 public:
  explicit TriangleSet(size_t capacity) : table_(std::bit_ceil(capacity * 2 + 1), {kEmpty, 0, 0}) {}

  bool insert(std::array<uint32_t, 3> t) {
    std::sort(t.begin(), t.end());
    uint64_t h = 0;
    for (uint32_t v : t) h = (h ^ v) * 0x9e3779b97f4a7c15ull, h ^= h >> 29;
    size_t mask = table_.size() - 1, slot = h & mask;
    while (table_[slot][0] != kEmpty && table_[slot] != t) slot = (slot + 1) & mask;
    if (table_[slot][0] != kEmpty) return false;
    table_[slot] = t;
    return true;
  }

 private:
  static constexpr uint32_t kEmpty = 0xffffffffu;
  std::vector<std::array<uint32_t, 3>> table_;
};

// Merges vertices of equal position and drops triangles that repeat a vertex or another triangle.
Faces merge_and_clean(const TriangleMesh& mesh, std::vector<std::string>& warnings) {
  std::vector<uint32_t> merged = weld_positions(mesh.positions);
  Faces faces;
  faces.triangles.reserve(mesh.triangles.size());
  faces.source.reserve(mesh.triangles.size());
  TriangleSet seen(mesh.triangles.size());
  size_t degenerate = 0, duplicate = 0;
  for (size_t i = 0; i < mesh.triangles.size(); i++) {
    const auto& [a, b, c] = mesh.triangles[i];
    std::array<uint32_t, 3> t = {merged[a], merged[b], merged[c]};
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
      degenerate++;
    } else if (!seen.insert(t)) {
      duplicate++;
    } else {
      faces.triangles.push_back(t);
      faces.source.push_back(int(i));
    }
  }
  warn(warnings, "dropped", degenerate, "degenerate triangle", "degenerate triangles");
  warn(warnings, "dropped", duplicate, "duplicate triangle", "duplicate triangles");
  return faces;
}

Vec3 position(const TriangleMesh& mesh, uint32_t v) {
  return {mesh.positions[v][0], mesh.positions[v][1], mesh.positions[v][2]};
}

// Twice the area times the normal, in the input's coordinates.
Vec3 area_vector(const TriangleMesh& mesh, const std::array<uint32_t, 3>& t) {
  Vec3 a = position(mesh, t[0]);
  return (position(mesh, t[1]) - a).cross(position(mesh, t[2]) - a);
}

// How far the surface bends across an edge if half-edges g and h, which run opposite ways, were joined: 0
// flat, pi folded. Of two that bend the same, the convex one comes first: solids that touch stay apart.
double bend(const TriangleMesh& mesh, const Triangles& triangles, uint32_t g, uint32_t h) {
  Vec3 m = area_vector(mesh, triangles[g / 3]), n = area_vector(mesh, triangles[h / 3]);
  Vec3 along = position(mesh, to_vertex(triangles, g)) - position(mesh, from_vertex(triangles, g));
  bool convex = m.cross(n).dot(along) > 0;
  return std::atan2(m.cross(n).norm(), m.dot(n)) + (convex ? 0 : 1e-3);
}

// An edge of three or more triangles: joins the pairs that bend least, cuts what is left.
void match_crowded_edge(const TriangleMesh& mesh, const std::vector<uint32_t>& edge, Faces& faces) {
  constexpr size_t kMost = 16;  // beyond that nothing is a surface, and all pairs would be many
  if (edge.size() > kMost) return;
  std::vector<std::tuple<double, uint32_t, uint32_t>> pairs;
  for (uint32_t g : edge)
    for (uint32_t h : edge)
      if (g < h && from_vertex(faces.triangles, g) != from_vertex(faces.triangles, h))
        pairs.emplace_back(bend(mesh, faces.triangles, g, h), g, h);
  std::sort(pairs.begin(), pairs.end());
  for (const auto& [cost, g, h] : pairs)
    if (faces.opposite[g] == kNoHalfEdge && faces.opposite[h] == kNoHalfEdge)
      faces.opposite[g] = h, faces.opposite[h] = g;
}

// Pairs the half-edges of every edge of two triangles, whichever way they run, and what can be paired of the
// others.
void match_edges(const TriangleMesh& mesh, Faces& faces, std::vector<std::string>& warnings) {
  faces.opposite.assign(faces.triangles.size() * 3, kNoHalfEdge);
  for_each_edge(faces.triangles, mesh.positions.size(), [&](std::span<const uint32_t> edge) {
    if (edge.size() == 2) faces.opposite[edge[0]] = edge[1], faces.opposite[edge[1]] = edge[0];
    if (edge.size() > 2) faces.crowded.emplace_back(edge.begin(), edge.end());
  });
  for (const auto& edge : faces.crowded) match_crowded_edge(mesh, edge, faces);
  warn(warnings, "split", faces.crowded.size(), "non-manifold edge", "non-manifold edges");
}

// Floods each component across its matched edges, so that neighbours run their common edge both ways; the
// larger part of a component by area keeps its side. Returns which triangles must turn around.
std::vector<char> flood_orientation(const TriangleMesh& mesh, const Faces& faces) {
  const Triangles& triangles = faces.triangles;
  enum : char { kKeep, kTurn, kUnseen };
  std::vector<char> turn(triangles.size(), kUnseen);
  std::vector<uint32_t> component;
  for (uint32_t seed = 0; seed < turn.size(); seed++) {
    if (turn[seed] != kUnseen) continue;
    component.assign(1, seed);
    turn[seed] = kKeep;
    double area[2] = {0, 0};
    for (size_t i = 0; i < component.size(); i++) {
      uint32_t f = component[i];
      area[int(turn[f])] += area_vector(mesh, triangles[f]).norm();
      for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
        uint32_t o = faces.opposite[h];
        if (o == kNoHalfEdge || turn[o / 3] != kUnseen) continue;
        bool agree = from_vertex(triangles, h) == to_vertex(triangles, o);
        turn[o / 3] = agree ? turn[f] : char(1 - turn[f]);
        component.push_back(o / 3);
      }
    }
    if (area[kTurn] > area[kKeep])
      for (uint32_t f : component) turn[f] = char(1 - turn[f]);
  }
  return turn;
}

// Turns triangles around and cuts the edges where that does not make neighbours agree (as on a Moebius
// strip).
void orient(const TriangleMesh& mesh, Faces& faces, std::vector<std::string>& warnings) {
  std::vector<char> turn = flood_orientation(mesh, faces);
  std::vector<uint32_t>& opposite = faces.opposite;
  size_t turned = size_t(std::count(turn.begin(), turn.end(), 1)), cut = 0;
  if (turned > 0) {
    // (a, b, c) becomes (a, c, b), so edge k becomes edge 2 - k.
    auto renamed = [&](uint32_t h) { return turn[h / 3] ? h / 3 * 3 + 2 - h % 3 : h; };
    std::vector<uint32_t> old = opposite;
    for (uint32_t h = 0; h < old.size(); h++)
      opposite[renamed(h)] = old[h] == kNoHalfEdge ? kNoHalfEdge : renamed(old[h]);
    for (auto& edge : faces.crowded)
      for (uint32_t& h : edge) h = renamed(h);
    for (size_t f = 0; f < turn.size(); f++)
      if (turn[f]) std::swap(faces.triangles[f][1], faces.triangles[f][2]);
  }
  for (uint32_t h = 0; h < opposite.size(); h++) {
    uint32_t o = opposite[h];
    if (o == kNoHalfEdge || from_vertex(faces.triangles, h) != from_vertex(faces.triangles, o)) continue;
    opposite[h] = opposite[o] = kNoHalfEdge;
    cut++;
  }
  warn(warnings, "turned", turned, "triangle around", "triangles around");
  warn(warnings, "split", cut, "edge where the surface has no orientation",
       "edges where the surface has no orientation");
}

// Cuts pairs at crowded edges whose ends would be the same two vertices as those of another half-edge of that
// edge. What is cut here is joined again by rejoin_cuts if it belongs together.
void cut_repeated_edges(Faces& faces) {
  if (faces.crowded.empty()) return;
  std::vector<uint32_t> fan = label_fans(faces.opposite, [](uint32_t) {});
  auto ends = [&](uint32_t h) { return std::minmax(fan[h], fan[next_half_edge(h)]); };
  std::vector<std::pair<std::pair<uint32_t, uint32_t>, uint32_t>> sorted;  // ends, half-edge
  for (const auto& edge : faces.crowded) {
    sorted.clear();
    for (uint32_t h : edge) sorted.push_back({ends(h), h});
    std::sort(sorted.begin(), sorted.end());
    for (size_t i = 0, j = 0; i < sorted.size(); i = j) {
      while (j < sorted.size() && sorted[j].first == sorted[i].first) j++;
      if (j - i <= 2) continue;  // a pair has its two ends for itself
      for (size_t k = i; k < j; k++) faces.opposite[sorted[k].second] = kNoHalfEdge;
    }
  }
}

// Renumbers the vertices: one for each fan of triangles, unused ones dropped, in the order of the input and
// with the further fans of a vertex at the end. Returns the input's vertex of each.
std::vector<uint32_t> split_fans(Faces& faces, size_t vertex_count, std::vector<std::string>& warnings) {
  Triangles& triangles = faces.triangles;
  std::vector<uint32_t> fan_vertex;  // of the input
  std::vector<uint32_t> fan = label_fans(
      faces.opposite, [&](uint32_t corner) { fan_vertex.push_back(from_vertex(triangles, corner)); });
  std::vector<uint32_t> first_fan(vertex_count, kNoHalfEdge), rank(fan_vertex.size()), vertices;
  for (uint32_t i = 0; i < fan_vertex.size(); i++)
    if (first_fan[fan_vertex[i]] == kNoHalfEdge) first_fan[fan_vertex[i]] = i;
  for (uint32_t v = 0; v < vertex_count; v++)
    if (first_fan[v] != kNoHalfEdge) rank[first_fan[v]] = uint32_t(vertices.size()), vertices.push_back(v);
  std::vector<char> is_split(vertex_count, 0);
  for (uint32_t i = 0; i < fan_vertex.size(); i++) {
    uint32_t v = fan_vertex[i];
    if (first_fan[v] == i) continue;
    rank[i] = uint32_t(vertices.size());
    vertices.push_back(v);
    is_split[v] = 1;
  }
  for (uint32_t h = 0; h < fan.size(); h++) triangles[h / 3][h % 3] = rank[fan[h]];
  warn(warnings, "split", size_t(std::count(is_split.begin(), is_split.end(), 1)), "non-manifold vertex",
       "non-manifold vertices");
  return vertices;
}

// Where both ends of a cut edge still belong to one fan each, the two sides meet again. A fan has at most one
// border half-edge that leaves its vertex, so there is no choice to make.
void rejoin_cuts(Faces& faces, size_t vertex_count) {
  const Triangles& triangles = faces.triangles;
  std::vector<uint32_t>& opposite = faces.opposite;
  std::vector<uint32_t> leaves(vertex_count, kNoHalfEdge);
  for (uint32_t h = 0; h < opposite.size(); h++)
    if (opposite[h] == kNoHalfEdge) leaves[from_vertex(triangles, h)] = h;
  for (uint32_t h = 0; h < opposite.size(); h++) {
    uint32_t o = leaves[to_vertex(triangles, h)];
    if (opposite[h] == kNoHalfEdge && o != kNoHalfEdge &&
        to_vertex(triangles, o) == from_vertex(triangles, h))
      opposite[h] = o, opposite[o] = h;
  }
}

// The triangles across the edges of each.
std::vector<std::array<int, 3>> neighbours_of(const std::vector<uint32_t>& opposite) {
  std::vector<std::array<int, 3>> adjacent(opposite.size() / 3);
  for (size_t h = 0; h < opposite.size(); h++)
    adjacent[h / 3][h % 3] = opposite[h] == kNoHalfEdge ? -1 : int(opposite[h] / 3);
  return adjacent;
}

// The lattice: see surface.h. The box is that of all vertices, used or not, as for the error measure.
void place_lattice(const TriangleMesh& mesh, Surface& surface) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::max()), high = -low;
  for (const auto& p : mesh.positions) {
    low = low.cwiseMin(Vec3(p[0], p[1], p[2]));
    high = high.cwiseMax(Vec3(p[0], p[1], p[2]));
  }
  double diagonal = (high - low).norm();
  if (!(diagonal > 0)) throw InputError("has no triangle of positive area");
  surface.origin = (low + high) / 2;
  surface.scale = diagonal / kLatticeDiagonal;
}

void measure_faces(Surface& surface) {
  size_t flat = 0;
  for (const auto& f : surface.faces) {
    const Vec3 &a = surface.vertices[f[0]], &b = surface.vertices[f[1]], &c = surface.vertices[f[2]];
    Vec3 normal = (b - a).cross(c - a);
    double twice = normal.norm();
    double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    // Below this the normal is rounding noise of coordinates that were floats.
    bool has_area = twice > 1e-9 * longest;
    surface.normals.push_back(has_area ? Vec3(normal / twice) : Vec3(Vec3::Zero()));
    surface.areas.push_back(has_area ? twice / 2 : 0);
    surface.total_area += surface.areas.back();
    flat += !has_area;
  }
  warn(surface.warnings, "found", flat, "triangle without area", "triangles without area");
}

void label_components(Surface& surface) {
  surface.component.assign(surface.faces.size(), -1);
  std::vector<int> queue;
  for (size_t seed = 0; seed < surface.faces.size(); seed++) {
    if (surface.component[seed] >= 0) continue;
    int label = int(surface.component_area.size());
    surface.component_area.push_back(0);
    surface.component[seed] = label;
    queue.assign(1, int(seed));
    while (!queue.empty()) {
      int f = queue.back();
      queue.pop_back();
      surface.component_area.back() += surface.areas[f];
      for (int g : surface.adjacent[f])
        if (g >= 0 && surface.component[g] < 0) surface.component[g] = label, queue.push_back(g);
    }
  }
}

}  // namespace

Surface build_surface(const TriangleMesh& mesh) {
  check_input(mesh);
  Surface surface;
  place_lattice(mesh, surface);
  Faces faces = merge_and_clean(mesh, surface.warnings);
  match_edges(mesh, faces, surface.warnings);
  orient(mesh, faces, surface.warnings);
  cut_repeated_edges(faces);
  std::vector<uint32_t> vertices = split_fans(faces, mesh.positions.size(), surface.warnings);
  rejoin_cuts(faces, vertices.size());
  surface.adjacent = neighbours_of(faces.opposite);

  surface.source = std::move(faces.source);
  surface.faces.reserve(faces.triangles.size());
  for (const auto& t : faces.triangles) surface.faces.push_back({int(t[0]), int(t[1]), int(t[2])});
  surface.vertices.reserve(vertices.size());
  for (uint32_t v : vertices) {
    const auto& p = mesh.positions[v];
    surface.vertices.push_back((Vec3(p[0], p[1], p[2]) - surface.origin) / surface.scale);
  }
  measure_faces(surface);
  if (!(surface.total_area > 0)) throw InputError("has no triangle of positive area");
  label_components(surface);
  return surface;
}

}  // namespace relief
