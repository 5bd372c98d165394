// Closing faces between patches with triangles (4.2): vertices stay where they are, no edge is made twice.
#include <string.h>

#include "gap_state.h"

namespace relief {
namespace {

constexpr uint32_t kMaxEarFace = 256;  // corners of a face that is closed by ears; larger ones get a fan
constexpr uint32_t kBestFace = 16;     // corners up to which the best of all triangulations is found

bool has_edge(const Gaps& g, uint32_t a, uint32_t b) {
  if (g.n.next[a] == b || g.n.prev[a] == b || g.neighbouring_pixels(a, b)) return true;
  for (uint32_t i = g.slot_begin[a]; i < g.slot_begin[a + 1]; i++)
    if (g.slots[i].to == b && g.is_in(i)) return true;
  for (uint32_t i = g.diagonals[a]; i != kNone; i = g.diagonal[i].next)
    if (g.diagonal[i].to == b) return true;
  return false;
}

void add_diagonal(Gaps& g, uint32_t a, uint32_t b) {
  g.diagonal[g.diagonal_count] = {b, g.diagonals[a]};
  g.diagonals[a] = g.diagonal_count++;
  g.diagonal[g.diagonal_count] = {a, g.diagonals[b]};
  g.diagonals[b] = g.diagonal_count++;
}

bool add_triangle(Gaps& g, uint32_t a, uint32_t b, uint32_t c) {
  MeshWriter& m = g.mesh;
  if (m.triangle_count == m.triangle_capacity) return false;
  uint32_t* t = m.indices + 3 * size_t(m.triangle_count++);
  t[0] = a, t[1] = b, t[2] = c;
  return true;
}

bool add_vertex(Gaps& g, const int64_t p[3], uint32_t& vertex) {
  MeshWriter& m = g.mesh;
  if (m.vertex_count == m.vertex_capacity) return false;
  vertex = m.vertex_count++;
  for (int k = 0; k < 3; k++) m.positions[3 * size_t(vertex) + k] = float(p[k]);
  return true;
}

// How well the triangle's normal agrees with the surface at its corners: kUnit for entirely, negative for
// turned over.
int64_t alignment(const Gaps& g, uint32_t a, uint32_t b, uint32_t c) {
  double u[3], v[3], w[3];
  g.difference(b, c, u);
  g.difference(b, a, v);
  cross(u, v, w);
  int16_t unit[3];
  unit_vector(w, unit);
  if (!(unit[0] | unit[1] | unit[2])) return -kUnit;
  const int64_t sum = int64_t(dot(unit, g.n.normal[a])) + dot(unit, g.n.normal[b]) + dot(unit, g.n.normal[c]);
  return sum / (3 * kUnit);
}

constexpr int64_t kNoEar = INT64_MAX;

// The cost of a triangle that lies badly in the surface, as a factor and a summand of a length: short edges
// are good, triangles turned over are to be avoided at the price of some long ones.
int64_t weigh(const Gaps& g, int64_t length, int64_t aligned) {
  const int64_t cost = length * (10 * kUnit + 6 * (kUnit - aligned)) / 10;
  return aligned < 0 ? cost + 10 * int64_t(g.options.spacing) * (kUnit - aligned) : cost;
}

// The cost of cutting off corner b with neighbours a and c: a short new edge and a triangle that lies in the
// surface.
int64_t ear_cost(const Gaps& g, uint32_t a, uint32_t b, uint32_t c) {
  if (a == c || has_edge(g, a, c)) return kNoEar;
  return weigh(g, root(g.distance2(a, c)), alignment(g, a, b, c));
}

// Cuts off ears until `few` corners are left or none can be cut. Returns the number of corners left in q.
uint32_t clip_ears(Gaps& g, uint32_t* q, uint32_t m, uint32_t few, bool& room) {
  int64_t cost[kMaxEarFace];
  auto cost_at = [&](uint32_t i) { return ear_cost(g, q[(i + m - 1) % m], q[i], q[(i + 1) % m]); };
  for (uint32_t i = 0; i < m; i++) cost[i] = cost_at(i);
  while (m > few) {
    uint32_t best = 0;
    for (uint32_t i = 1; i < m; i++)
      if (cost[i] < cost[best]) best = i;
    if (cost[best] == kNoEar) return m;
    const uint32_t a = q[(best + m - 1) % m], b = q[best], c = q[(best + 1) % m];
    if (has_edge(g, a, c)) {  // made since the cost was found
      cost[best] = kNoEar;
      continue;
    }
    room = room && add_triangle(g, g.n.vertex[a], g.n.vertex[b], g.n.vertex[c]);
    add_diagonal(g, a, c);
    m--;
    memmove(q + best, q + best + 1, (m - best) * sizeof(q[0]));
    memmove(cost + best, cost + best + 1, (m - best) * sizeof(cost[0]));
    cost[best % m] = cost_at(best % m);
    cost[(best + m - 1) % m] = cost_at((best + m - 1) % m);
  }
  return m;
}

// The cheapest of all triangulations of a polygon of up to kBestFace corners (Klincsek 1980): best[i][j] is
// that of the part between corners i and j, split at corner at[i][j].
struct Triangulation {
  int64_t best[kBestFace][kBestFace];
  uint8_t at[kBestFace][kBestFace];
};

int64_t triangle_cost(const Gaps& g, uint32_t a, uint32_t b, uint32_t c) {
  if (a == b || b == c || c == a) return kNoEar;
  return weigh(g, root(g.distance2(a, b)) + root(g.distance2(b, c)) + root(g.distance2(c, a)),
               alignment(g, a, b, c));
}

void find_triangulation(const Gaps& g, const uint32_t* q, uint32_t m, Triangulation& t) {
  for (uint32_t i = 0; i + 1 < m; i++) t.best[i][i + 1] = 0;
  for (uint32_t span = 2; span < m; span++)
    for (uint32_t i = 0; i + span < m; i++) {
      const uint32_t j = i + span;
      int64_t least = kNoEar;
      uint32_t split = i + 1;
      const bool barred = span + 1 < m && (q[i] == q[j] || has_edge(g, q[i], q[j]));
      for (uint32_t k = i + 1; k < j && !barred; k++) {
        if (t.best[i][k] == kNoEar || t.best[k][j] == kNoEar) continue;
        const int64_t cost = triangle_cost(g, q[i], q[k], q[j]);
        if (cost == kNoEar || t.best[i][k] + t.best[k][j] + cost >= least) continue;
        least = t.best[i][k] + t.best[k][j] + cost;
        split = k;
      }
      t.best[i][j] = least;
      t.at[i][j] = uint8_t(split);
    }
}

// Adds the triangles of the best triangulation. False, with nothing added, if there is none that makes no
// edge twice.
bool fill_best(Gaps& g, const uint32_t* q, uint32_t m, bool& room) {
  Triangulation t;
  find_triangulation(g, q, m, t);
  if (t.best[0][m - 1] == kNoEar) return false;
  struct Part {
    uint8_t i, j;
  } stack[kBestFace];
  Part made[kBestFace];  // diagonals
  uint32_t parts = 1, diagonals = 0;
  stack[0] = {0, uint8_t(m - 1)};
  Part order[kBestFace];
  uint32_t triangles = 0;
  while (parts > 0) {
    const Part p = stack[--parts];
    if (p.j - p.i < 2) continue;
    if (p.j - p.i + 1u < m) made[diagonals++] = p;
    order[triangles++] = p;
    const uint8_t k = t.at[p.i][p.j];
    stack[parts++] = {p.i, k};
    stack[parts++] = {k, p.j};
  }
  // where a node is a corner twice, two diagonals can be one edge
  for (uint32_t x = 0; x < diagonals; x++)
    for (uint32_t y = 0; y < x; y++) {
      const uint32_t a = q[made[x].i], b = q[made[x].j], c = q[made[y].i], d = q[made[y].j];
      if ((a == c && b == d) || (a == d && b == c)) return false;
    }
  for (uint32_t x = 0; x < diagonals; x++) add_diagonal(g, q[made[x].i], q[made[x].j]);
  for (uint32_t x = 0; x < triangles; x++)
    room = room && add_triangle(g, g.n.vertex[q[order[x].i]], g.n.vertex[q[t.at[order[x].i][order[x].j]]],
                                g.n.vertex[q[order[x].j]]);
  return true;
}

bool all_distinct(Gaps& g, const uint32_t* q, uint32_t m) {
  g.mark_count++;
  for (uint32_t i = 0; i < m; i++) {
    if (g.mark[q[i]] == g.mark_count) return false;
    g.mark[q[i]] = g.mark_count;
  }
  return true;
}

bool add_fan(Gaps& g, uint32_t m, const int64_t middle[3], const uint32_t* rim, uint32_t first) {
  uint32_t centre;
  if (!add_vertex(g, middle, centre)) return false;
  for (uint32_t i = 0; i < m; i++) {
    const uint32_t j = (i + 1) % m;
    if (!add_triangle(g, rim ? g.n.vertex[rim[i]] : first + i, rim ? g.n.vertex[rim[j]] : first + j, centre))
      return false;
  }
  return true;
}

// A corner moved a quarter of the grid's spacing into its face: towards the middle of the corners before and
// after, so that a node which comes twice is moved to two places.
void move_inwards(const Gaps& g, const uint32_t* q, uint32_t m, uint32_t i, int64_t out[3]) {
  const uint32_t node = q[i], before = q[(i + m - 1) % m], after = q[(i + 1) % m];
  int64_t d[3], square = 0;
  for (int k = 0; k < 3; k++) {
    d[k] = int64_t(g.n.position[before][k]) + g.n.position[after][k] - 2 * int64_t(g.n.position[node][k]);
    square += d[k] * d[k];
  }
  const int64_t reach = g.n.spacing[node] / 4, length = root(square) + 1;
  for (int k = 0; k < 3; k++)
    out[k] = g.n.position[node][k] + (length > reach ? d[k] * reach / length : d[k]);
}

// Closes a face around its middle: by a fan, or, where a node comes twice on its rim, by a ring of new
// vertices (then no edge can come twice) with a fan inside. open: leave the fan away.
bool close_around_middle(Gaps& g, const uint32_t* q, uint32_t m, bool open) {
  int64_t middle[3] = {0, 0, 0};
  for (uint32_t i = 0; i < m; i++)
    for (int k = 0; k < 3; k++) middle[k] += g.n.position[q[i]][k];
  for (int64_t& c : middle) c /= m;
  if (!open && all_distinct(g, q, m)) return add_fan(g, m, middle, q, 0);
  const uint32_t first = g.mesh.vertex_count;
  for (uint32_t i = 0; i < m; i++) {
    int64_t p[3];
    move_inwards(g, q, m, i, p);
    uint32_t vertex;
    if (!add_vertex(g, p, vertex)) return false;
  }
  for (uint32_t i = 0; i < m; i++) {
    const uint32_t j = (i + 1) % m, u = g.n.vertex[q[i]], v = g.n.vertex[q[j]];
    if (!add_triangle(g, u, v, first + i) || !add_triangle(g, v, first + j, first + i)) return false;
  }
  return open || add_fan(g, m, middle, nullptr, first);
}

// A face that stays open, unless a vertex would get two holes: there a ring of triangles keeps them apart.
bool leave_open(Gaps& g, const uint32_t* q, uint32_t m) {
  bool clean = all_distinct(g, q, m);
  for (uint32_t i = 0; i < m; i++) clean = clean && !g.open_corner[q[i]];
  if (!clean) return close_around_middle(g, q, m, true);
  for (uint32_t i = 0; i < m; i++) g.open_corner[q[i]] = 1;
  return true;
}

bool close_face(Gaps& g, uint32_t m) {
  uint32_t* q = g.face;
  if (m < 3) return true;
  bool room = true;
  if (m == 3 && q[0] != q[1] && q[1] != q[2] && q[2] != q[0])
    return add_triangle(g, g.n.vertex[q[0]], g.n.vertex[q[1]], g.n.vertex[q[2]]);
  if (m > kBestFace && m <= kMaxEarFace) m = clip_ears(g, q, m, kBestFace, room);
  if (m <= kBestFace && fill_best(g, q, m, room)) return room;
  return room && close_around_middle(g, q, m, false);
}

}  // namespace

relief_status close_faces(Gaps& g) {
  for (uint32_t v = 0; v < g.count; v++) {
    g.diagonals[v] = kNone;
    g.open_corner[v] = 0;
    g.mark[v] = 0;
  }
  const uint32_t corners = g.count + g.slot_begin[g.count];
  for (uint32_t c = 0; c < corners; c++) g.face_of_corner[c] = kNone;
  const GapOptions& o = g.options;
  NumberList holes = {g.seams.p, g.seams.end};
  if (o.seams) holes.advance();
  g.face_count = g.diagonal_count = g.mark_count = 0;
  auto close = [&](uint32_t start, uint32_t node) {
    uint32_t m = 0, c = start;
    do {
      g.face[m++] = node;
      g.face_of_corner[c] = g.face_count;
      node = c < g.count ? g.n.prev[node] : g.slots[c - g.count].to;
      c = g.next_corner[c];
    } while (c != start);
    g.face_count++;
    if (kTracing && o.trace && o.trace->count < o.trace->capacity)
      o.trace->first_triangle[o.trace->count++] = g.mesh.triangle_count;
    bool open = !o.closed && !o.seams && m > kBigFace;
    if (!o.closed && o.seams && holes.next == g.face_count) {
      open = true;
      holes.advance();
    }
    return open ? leave_open(g, g.face, m) : close_face(g, m);
  };
  bool room = true;
  for (uint32_t v = 0; v < g.count && room; v++)
    if (g.face_of_corner[v] == kNone) room = close(v, v);
  for (uint32_t s = 0; s < g.slot_begin[g.count] && room; s++)
    if (g.is_in(s) && g.face_of_corner[g.corner_of(s)] == kNone)
      room = close(g.corner_of(s), g.slots[g.slots[s].twin].to);
  return !room ? RELIEF_ERROR_OUTPUT : holes.good ? RELIEF_OK : RELIEF_ERROR_CORRUPT;
}

}  // namespace relief
