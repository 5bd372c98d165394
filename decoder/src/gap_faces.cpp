// Closing faces between patches with triangles (4.2): vertices stay where they are, no edge is made twice.
#include <string.h>

#include "gap_state.h"
#include "triangulation.h"

namespace relief {
namespace {

constexpr uint32_t kMaxEarFace = 256;  // corners of a face that is closed by ears; larger ones get a fan

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

// The corners i to j of a polygon: a triangle on the diagonal between them, and what that leaves over.
struct Part {
  uint8_t i, j;
  uint32_t middle;  // the vertex that splits the diagonal, or kNone
};

// Makes the diagonal from a to b between the triangles with c and d; split if there is such an edge, by a
// vertex a sixteenth of the way from its middle to one of theirs, so that the two edges do not lie in one
// place: the other one in a face with the same corners in reverse, as there are on both sides of what is
// thin. False: no room.
bool make_diagonal(Gaps& g, uint32_t a, uint32_t b, uint32_t c, uint32_t d, uint32_t& middle) {
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
bool add_split_triangle(Gaps& g, const uint32_t node[3], const uint32_t middle[3]) {
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
bool fill_best(Gaps& g, const uint32_t* q, uint32_t m, bool& room) {
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
void move_inwards(const Gaps& g, const uint32_t* q, uint32_t m, uint32_t i, int64_t out[3]) {
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
void find_repeated(Gaps& g, const uint32_t* q, uint32_t m) {
  g.mark_count += 2;
  for (uint32_t i = 0; i < m; i++)
    g.mark[q[i]] = g.mark[q[i]] + 1 < g.mark_count ? g.mark_count - 1 : g.mark_count;
}

// Whether a rim inside of the face gets a new vertex in place of this node: no vertex may come twice on it,
// nor have two holes.
bool is_moved(const Gaps& g, uint32_t node, bool open) {
  return g.mark[node] == g.mark_count || (open && g.open_corner[node]);
}

bool add_moved_corners(Gaps& g, const uint32_t* q, uint32_t m, bool open) {
  for (uint32_t i = 0; i < m; i++) {
    if (!is_moved(g, q[i], open)) continue;
    int64_t p[3];
    move_inwards(g, q, m, i, p);
    uint32_t vertex;
    if (!add_vertex(g, p, vertex)) return false;
  }
  return true;
}

bool add_middle(Gaps& g, const uint32_t* q, uint32_t m, uint32_t& vertex) {
  int64_t middle[3] = {0, 0, 0};
  for (uint32_t i = 0; i < m; i++)
    for (int k = 0; k < 3; k++) middle[k] += g.n[q[i]].position[k];
  for (int64_t& c : middle) c /= m;
  return add_vertex(g, middle, vertex);
}

// Closes a face by a fan around its middle. Where nodes are moved the fan ends at the new vertices, with
// triangles out to the nodes: then no edge can come twice. open: leave the fan away.
bool close_around_middle(Gaps& g, const uint32_t* q, uint32_t m, bool open) {
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
bool leave_open(Gaps& g, const uint32_t* q, uint32_t m) {
  if (!close_around_middle(g, q, m, true)) return false;
  for (uint32_t i = 0; i < m; i++)
    if (!is_moved(g, q[i], true)) g.open_corner[q[i]] = 1;
  return true;
}

bool close_face(Gaps& g, uint32_t m) {
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

relief_status close_faces(Gaps& g) {
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
