// Closing faces between patches with triangles (4.2): vertices stay where they are, no edge is made twice.
#include <string.h>

#include "gap_state.h"

namespace relief {
namespace {

constexpr uint32_t kMaxEarFace = 256;  // corners of a face that is closed by ears; larger ones get a fan
constexpr uint32_t kBestFace = 12;     // corners up to which the best of all triangulations is found

bool has_edge(const Gaps& g, uint32_t a, uint32_t b) {
  if (g.n[a].next == b || g.n[a].prev == b || neighbouring_pixels(g.n[a], g.n[b])) return true;
  for (uint32_t i = g.slot_begin[a]; i < g.slot_begin[a + 1]; i++)
    if (g.slots[i].to == b && g.is_in(i)) return true;
  for (uint32_t i = g.diagonals[a]; i != kNone; i = g.diagonal[i].next)
    if (g.diagonal[i].to == b) return true;
  return false;
}

RELIEF_COLD void add_diagonal(Gaps& g, uint32_t a, uint32_t b) {
  g.diagonal[g.diagonal_count] = {b, g.diagonals[a]};
  g.diagonals[a] = g.diagonal_count++;
  g.diagonal[g.diagonal_count] = {a, g.diagonals[b]};
  g.diagonals[b] = g.diagonal_count++;
}

RELIEF_COLD bool add_triangle(Gaps& g, uint32_t a, uint32_t b, uint32_t c) {
  MeshWriter& m = g.mesh;
  if (m.triangle_count == m.triangle_capacity) return false;
  uint32_t* t = m.indices + 3 * size_t(m.triangle_count++);
  t[0] = a, t[1] = b, t[2] = c;
  return true;
}

RELIEF_COLD bool add_vertex(Gaps& g, const int64_t p[3], uint32_t& vertex) {
  MeshWriter& m = g.mesh;
  if (m.vertex_count == m.vertex_capacity) return false;
  vertex = m.vertex_count++;
  for (int k = 0; k < 3; k++) m.positions[3 * size_t(vertex) + k] = float(p[k]);
  return true;
}

// The unit normal of a triangle; zero if it has none.
void normal_of(const Gaps& g, uint32_t a, uint32_t b, uint32_t c, int16_t unit[3]) {
  int64_t u[3], v[3], w[3];
  difference(g.n[b], g.n[c], u);
  difference(g.n[b], g.n[a], v);
  cross(u, v, w);
  unit_vector(w, unit);
}

// How well a triangle's normal agrees with the surface at its corners: kUnit for entirely, negative for
// turned over.
int64_t alignment(const Gaps& g, uint32_t a, uint32_t b, uint32_t c, const int16_t unit[3]) {
  if (!(unit[0] | unit[1] | unit[2])) return -kUnit;
  return (dot(unit, g.n[a].normal) + dot(unit, g.n[b].normal) + dot(unit, g.n[c].normal)) / (3 * kUnit);
}

int32_t distance(const Gaps& g, uint32_t a, uint32_t b) { return int32_t(root(distance2(g.n[a], g.n[b]))); }

constexpr int64_t kNoEar = INT64_MAX;

// The largest spacing of three nodes' grids.
int64_t spacing_at(const Gaps& g, uint32_t a, uint32_t b, uint32_t c) {
  const int32_t x = g.n[a].spacing, y = g.n[b].spacing, z = g.n[c].spacing, most = x > y ? x : y;
  return most > z ? most : z;
}

// The cost of a triangle with this unit normal, as a factor and a summand of a length: short edges are good,
// triangles turned over are to be avoided at the price of some long ones.
int64_t weigh(const Gaps& g, uint32_t a, uint32_t b, uint32_t c, const int16_t unit[3], int64_t length) {
  const int64_t aligned = alignment(g, a, b, c, unit);
  const int64_t cost = length * (kUnit + 4 * (kUnit - aligned));
  return aligned < 0 ? cost + 10 * spacing_at(g, a, b, c) * (kUnit - aligned) : cost;
}

// The cost of cutting off corner b with neighbours a and c: a short new edge and a triangle that lies in the
// surface.
RELIEF_COLD int64_t ear_cost(const Gaps& g, uint32_t a, uint32_t b, uint32_t c) {
  if (a == c || has_edge(g, a, c)) return kNoEar;
  int16_t unit[3];
  normal_of(g, a, b, c, unit);
  return weigh(g, a, b, c, unit, distance(g, a, c));
}

// Cuts off ears until `few` corners are left or none can be cut. Returns the number of corners left in q.
RELIEF_COLD uint32_t clip_ears(Gaps& g, uint32_t* q, uint32_t m, uint32_t few, bool& room) {
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
    room = room && add_triangle(g, g.n[a].vertex, g.n[b].vertex, g.n[c].vertex);
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
  int32_t length[kBestFace][kBestFace];  // from corner to corner
  // of the triangle on the part's diagonal; zero where there is none
  int16_t normal[kBestFace][kBestFace][3];
  uint8_t at[kBestFace][kBestFace];
};

// Of two triangles that are folded onto one another: as for one that is turned over.
int64_t cost_of_folding(const Gaps& g, const int16_t a[3], const int16_t b[3]) {
  const int64_t d = dot(a, b) / kUnit;
  return d < -kUnit * 7 / 8 ? 100 * int64_t(g.options.spacing) * -d : 0;
}

// What it costs to make an edge a second time: a vertex in its middle keeps the two apart.
int64_t cost_of_splitting(const Gaps& g) { return 8 * int64_t(g.options.spacing) * kUnit; }

// The normal beyond a side of a polygon: the patch's along its border, else unknown, zero.
RELIEF_COLD void normal_beyond(const Gaps& g, uint32_t a, uint32_t b, int16_t out[3]) {
  for (int k = 0; k < 3; k++)
    out[k] = g.n[a].prev == b ? int16_t((g.n[a].normal[k] + g.n[b].normal[k]) / 2) : int16_t(0);
}

// The node across the diagonal from corner i to corner j.
uint32_t across(const Triangulation& t, const uint32_t* q, uint32_t i, uint32_t j) {
  return j - i > 1 ? q[t.at[i][j]] : kNone;
}

// The best triangle on the diagonal from corner i to corner j, given what is best behind its other sides. No
// diagonal may have the same node on both sides: split, it would be joined to that node twice.
// beyond: the normal beyond the side from j to i.
void find_part(const Gaps& g, const uint32_t* q, uint32_t i, uint32_t j, const int16_t beyond[3],
               Triangulation& t) {
  t.best[i][j] = kNoEar;
  for (uint32_t k = i + 1; k < j; k++) {
    const uint32_t a = q[i], b = q[k], c = q[j];
    if (t.best[i][k] == kNoEar || t.best[k][j] == kNoEar || a == b || b == c || c == a) continue;
    if (across(t, q, i, k) == c || across(t, q, k, j) == a) continue;
    const int64_t parts = t.best[i][k] + t.best[k][j],
                  around = t.length[i][k] + t.length[k][j] + t.length[i][j];
    if (parts + around * kUnit >= t.best[i][j]) continue;  // weigh gives at least that
    int16_t unit[3];
    normal_of(g, a, b, c, unit);
    const int64_t cost = parts + weigh(g, a, b, c, unit, around) + cost_of_folding(g, unit, t.normal[i][k]) +
                         cost_of_folding(g, unit, t.normal[k][j]) + cost_of_folding(g, unit, beyond);
    if (cost >= t.best[i][j]) continue;
    t.best[i][j] = cost;
    t.at[i][j] = uint8_t(k);
    memcpy(t.normal[i][j], unit, sizeof unit);
  }
}

RELIEF_COLD bool find_triangulation(const Gaps& g, const uint32_t* q, uint32_t m, Triangulation& t) {
  for (uint32_t i = 0; i + 1 < m; i++) {
    t.best[i][i + 1] = 0;
    normal_beyond(g, q[i], q[i + 1], t.normal[i][i + 1]);
    for (uint32_t j = i + 1; j < m; j++) t.length[i][j] = distance(g, q[i], q[j]);
  }
  constexpr int16_t kUnknown[3] = {0, 0, 0};
  for (uint32_t span = 2; span + 1 < m; span++)
    for (uint32_t i = 0; i + span < m; i++) {
      const uint32_t j = i + span;
      find_part(g, q, i, j, kUnknown, t);
      if (t.best[i][j] != kNoEar && has_edge(g, q[i], q[j])) t.best[i][j] += cost_of_splitting(g);
    }
  int16_t beyond[3];
  normal_beyond(g, q[m - 1], q[0], beyond);
  find_part(g, q, 0, m - 1, beyond, t);
  return t.best[0][m - 1] != kNoEar;
}

// Which diagonal of a quad whose corners are different nodes is made, that from corner 0 or that from corner
// 1: what find_triangulation finds.
RELIEF_COLD uint32_t diagonal_of_quad(const Gaps& g, const uint32_t* q) {
  int32_t side[4];
  int16_t beyond[4][3], unit[4][3];  // unit: of the triangle that begins with that corner
  for (uint32_t i = 0; i < 4; i++) {
    const uint32_t a = q[i], b = q[(i + 1) % 4], c = q[(i + 2) % 4];
    side[i] = distance(g, a, b);
    normal_beyond(g, a, b, beyond[i]);
    normal_of(g, a, b, c, unit[i]);
  }
  int64_t cost[2] = {0, 0};
  for (uint32_t i = 0; i < 4; i++) {
    const uint32_t j = (i + 1) % 4, k = (i + 2) % 4;
    const int64_t around = int64_t(side[i]) + side[j] + distance(g, q[i], q[k]);
    cost[i % 2] += weigh(g, q[i], q[j], q[k], unit[i], around) + cost_of_folding(g, unit[i], beyond[i]) +
                   cost_of_folding(g, unit[i], beyond[j]);
  }
  for (uint32_t r = 0; r < 2; r++) {
    cost[r] += cost_of_folding(g, unit[r], unit[r + 2]);
    if (has_edge(g, q[r], q[r + 2])) cost[r] += cost_of_splitting(g);
  }
  return cost[1] <= cost[0];  // of equal ones the second
}

// The corners i to j of a polygon: a triangle on the diagonal between them, and what that leaves over.
struct Part {
  uint8_t i, j;
  uint32_t middle;  // the vertex that splits the diagonal, or kNone
};

// Makes the diagonal from a to b between the triangles with c and d; split if there is such an edge, by a
// vertex a sixteenth of the way from its middle to one of theirs, so that the two edges do not lie in one
// place: the other one in a face with the same corners in reverse, as there are on both sides of what is
// thin. False: no room.
RELIEF_COLD bool make_diagonal(Gaps& g, uint32_t a, uint32_t b, uint32_t c, uint32_t d, uint32_t& middle) {
  if (!has_edge(g, a, b)) {
    add_diagonal(g, a, b);
    return true;
  }
  const int32_t *from = g.n[a].position, *to = g.n[b].position, *towards = g.n[a < b ? d : c].position;
  int64_t p[3];
  for (int k = 0; k < 3; k++) p[k] = (15 * (int64_t(from[k]) + to[k]) + 2 * int64_t(towards[k])) / 32;
  return add_vertex(g, p, middle);
}

// A triangle whose sides may have a vertex in the middle: then a fan around the first of those.
RELIEF_COLD bool add_split_triangle(Gaps& g, const uint32_t node[3], const uint32_t middle[3]) {
  uint32_t v[6], n = 0, first = 0;
  for (int side = 0; side < 3; side++) {
    v[n++] = g.n[node[side]].vertex;
    if (middle[side] == kNone) continue;
    if (first == 0) first = n;
    v[n++] = middle[side];
  }
  for (uint32_t x = 1; x + 1 < n; x++)
    if (!add_triangle(g, v[first], v[(first + x) % n], v[(first + x + 1) % n])) return false;
  return true;
}

// Adds the triangles of the best triangulation. False, with nothing added, if there is none.
RELIEF_COLD bool fill_best(Gaps& g, const uint32_t* q, uint32_t m, bool& room) {
  Triangulation t;
  if (m == 4 && q[0] != q[2] && q[1] != q[3]) {
    const uint32_t r = diagonal_of_quad(g, q);
    if (!has_edge(g, q[r], q[r + 2])) {
      add_diagonal(g, q[r], q[r + 2]);
      const uint32_t v[4] = {g.n[q[0]].vertex, g.n[q[1]].vertex, g.n[q[2]].vertex, g.n[q[3]].vertex};
      room = add_triangle(g, v[0], v[2 - r], v[3]) && add_triangle(g, v[r], v[r + 1], v[r + 2]);
      return true;
    }
    t.at[0][3] = uint8_t(2 - r);
    t.at[0][2] = 1, t.at[1][3] = 2;
  } else if (!find_triangulation(g, q, m, t)) {
    return false;
  }
  Part parts[kBestFace];  // a queue
  parts[0] = {0, uint8_t(m - 1), kNone};
  uint32_t count = 1;
  auto side = [&](uint8_t i, uint8_t j, uint32_t behind) {
    uint32_t middle = kNone;
    if (j - i == 1) return middle;
    room = room && make_diagonal(g, q[i], q[j], q[t.at[i][j]], behind, middle);
    parts[count++] = {i, j, middle};
    return middle;
  };
  for (uint32_t x = 0; x < count; x++) {
    const Part p = parts[x];
    const uint8_t k = t.at[p.i][p.j];
    const uint32_t node[3] = {q[p.i], q[k], q[p.j]};
    const uint32_t first = side(p.i, k, node[2]), second = side(k, p.j, node[0]),
                   middle[3] = {first, second, p.middle};
    room = room && add_split_triangle(g, node, middle);
  }
  return true;
}

// A corner moved a quarter of the grid's spacing into its face: towards the middle of the corners before and
// after, so that a node which comes twice is moved to two places.
RELIEF_COLD void move_inwards(const Gaps& g, const uint32_t* q, uint32_t m, uint32_t i, int64_t out[3]) {
  const uint32_t node = q[i], before = q[(i + m - 1) % m], after = q[(i + 1) % m];
  int64_t d[3], square = 0;
  for (int k = 0; k < 3; k++) {
    d[k] = int64_t(g.n[before].position[k]) + g.n[after].position[k] - 2 * int64_t(g.n[node].position[k]);
    square += d[k] * d[k];
  }
  const int64_t reach = g.n[node].spacing / 4, length = root(square) + 1;
  for (int k = 0; k < 3; k++)
    out[k] = g.n[node].position[k] + (length > reach ? d[k] * reach / length : d[k]);
}

// Marks a face's nodes: those that come twice on its rim with the count itself.
RELIEF_COLD void find_repeated(Gaps& g, const uint32_t* q, uint32_t m) {
  g.mark_count += 2;
  for (uint32_t i = 0; i < m; i++)
    g.mark[q[i]] = g.mark[q[i]] + 1 < g.mark_count ? g.mark_count - 1 : g.mark_count;
}

// Whether a rim inside of the face gets a new vertex in place of this node: no vertex may come twice on it,
// nor have two holes.
bool is_moved(const Gaps& g, uint32_t node, bool open) {
  return g.mark[node] == g.mark_count || (open && g.open_corner[node]);
}

RELIEF_COLD bool add_moved_corners(Gaps& g, const uint32_t* q, uint32_t m, bool open) {
  for (uint32_t i = 0; i < m; i++) {
    if (!is_moved(g, q[i], open)) continue;
    int64_t p[3];
    move_inwards(g, q, m, i, p);
    uint32_t vertex;
    if (!add_vertex(g, p, vertex)) return false;
  }
  return true;
}

RELIEF_COLD bool add_middle(Gaps& g, const uint32_t* q, uint32_t m, uint32_t& vertex) {
  int64_t middle[3] = {0, 0, 0};
  for (uint32_t i = 0; i < m; i++)
    for (int k = 0; k < 3; k++) middle[k] += g.n[q[i]].position[k];
  for (int64_t& c : middle) c /= m;
  return add_vertex(g, middle, vertex);
}

// Closes a face by a fan around its middle. Where nodes are moved the fan ends at the new vertices, with
// triangles out to the nodes: then no edge can come twice. open: leave the fan away.
RELIEF_COLD bool close_around_middle(Gaps& g, const uint32_t* q, uint32_t m, bool open) {
  find_repeated(g, q, m);
  uint32_t next = g.mesh.vertex_count, middle = kNone;
  if (!add_moved_corners(g, q, m, open) || !(open || add_middle(g, q, m, middle))) return false;
  auto take = [&](uint32_t i) { return is_moved(g, q[i], open) ? next++ : g.n[q[i]].vertex; };
  const uint32_t start = take(0);
  for (uint32_t i = 0, inner = start; i < m; i++) {
    const uint32_t j = i + 1 < m ? i + 1 : 0, u = g.n[q[i]].vertex, v = g.n[q[j]].vertex;
    const uint32_t after = j ? take(j) : start;
    if (inner != u && !add_triangle(g, u, v, inner)) return false;
    if (after != v && !add_triangle(g, v, after, inner)) return false;
    if (!open && !add_triangle(g, inner, after, middle)) return false;
    inner = after;
  }
  return true;
}

// Notes the vertices that have a hole now.
RELIEF_COLD bool leave_open(Gaps& g, const uint32_t* q, uint32_t m) {
  if (!close_around_middle(g, q, m, true)) return false;
  for (uint32_t i = 0; i < m; i++)
    if (!is_moved(g, q[i], true)) g.open_corner[q[i]] = 1;
  return true;
}

RELIEF_COLD bool close_face(Gaps& g, uint32_t m) {
  uint32_t* q = g.face;
  if (m < 3) return true;
  bool room = true;
  if (m == 3 && q[0] != q[1] && q[1] != q[2] && q[2] != q[0])
    return add_triangle(g, g.n[q[0]].vertex, g.n[q[1]].vertex, g.n[q[2]].vertex);
  if (m > kBestFace && m <= kMaxEarFace) m = clip_ears(g, q, m, kBestFace, room);
  if (m <= kBestFace && fill_best(g, q, m, room)) return room;
  return room && close_around_middle(g, q, m, false);
}

}  // namespace

RELIEF_COLD relief_status close_faces(Gaps& g) {
  for (uint32_t v = 0; v < g.count; v++) {
    g.diagonals[v] = kNone;
    g.open_corner[v] = 0;
    g.mark[v] = 0;
    g.corner[v].face = v;
    for (uint32_t s = g.slot_begin[v]; s < g.slot_begin[v + 1]; s++)
      g.corner[g.corner_of(s)].face = g.is_in(s) ? v : kNone;
  }
  const GapOptions& o = g.options;
  NumberList holes = {g.seams.p, g.seams.end};
  if (o.seams) holes.advance();
  g.face_count = g.diagonal_count = g.mark_count = 0;
  auto close = [&](uint32_t start) {
    uint32_t m = 0, c = start;
    do {
      g.face[m++] = g.corner[c].face;
      g.corner[c].face = kNone;
      c = g.corner[c].next;
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
  const uint32_t corners = g.corner_of(g.slot_begin[g.count]);
  for (uint32_t c = 0; c < corners && room; c++)
    if (g.corner[c].face != kNone) room = close(c);
  if (!room) return RELIEF_ERROR_OUTPUT;
  while (holes.next) holes.advance();
  g.seams = holes;
  return holes.good ? RELIEF_OK : RELIEF_ERROR_CORRUPT;
}

}  // namespace relief
