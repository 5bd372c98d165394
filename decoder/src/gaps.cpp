// Gap closing in linear time by links and faces.
//
// Every node (border vertex) looks for the nearest node that faces it; the pairs are links (4.2's
// projections, with vertices for targets). Links and borders cut the space between the patches into faces,
// found by walking around them; each face is closed by clipping ears. All decisions are made with integers.
#include "gaps.h"

#include <string.h>

#include "container.h"

namespace relief {
namespace {

constexpr uint32_t kMaxDegree = 16;    // links at a node
constexpr uint32_t kMaxEarFace = 256;  // corners of a face that is closed by ears; larger ones get a fan
constexpr uint32_t kBigFace = 12;  // corners beyond which a face may be a hole when the stream does not say
constexpr int kCrossingReach = 4;  // nodes along a border between links that are tested for crossing
constexpr int kMaxVisits = 4096;  // nodes that one search looks at; only hostile streams crowd a cell so much

struct Slot {     // one end of a link, at a node
  uint32_t to;    // the other node
  uint32_t twin;  // the slot there
  uint32_t face;  // found by walking
  bool dead;
};

struct Link {
  uint32_t a, b;
};

struct Diagonal {
  uint32_t to, next;
};

// One of the two lists of the seams.
struct NumberList {
  const uint8_t *p, *end;
  uint32_t next = 0;  // the next number, plus one; 0: no more
  bool good = true;
  void advance() {
    uint32_t d = 0;
    if (!read_varint(p, end, d)) good = false;
    next = good && d ? next + d : 0;
  }
};

struct Gaps {
  const Nodes& n;
  const GapOptions& options;
  MeshWriter& mesh;
  uint32_t count, components;
  int64_t reach;  // how far a node looks for its partner
  // by node
  uint32_t *loop, *place, *loop_length, *nearest, *face_of_border, *degree, *slot_begin, *diagonals, *mark;
  int16_t (*outward)[3];
  uint8_t* open_corner;
  uint32_t *cell_begin, *cell_nodes, hash_mask;
  uint32_t* group;  // union-find over components
  Link* links;
  uint32_t link_count, link_capacity;
  Slot* slots;
  Diagonal* diagonal;
  uint32_t diagonal_count, diagonal_capacity;
  uint32_t* face;  // corners of the face at hand
  uint32_t* self;  // slots whose two sides are in one face
  uint32_t face_count, corner_capacity, mark_count;
  NumberList seams;
  int64_t work;  // steps of walking left for mending self-crossing faces

  Gaps(const Nodes& nodes, const GapOptions& o, MeshWriter& m)
      : n(nodes), options(o), mesh(m), seams{o.seams, o.seams_end} {}

  uint32_t find(uint32_t i) const {  // union-find with path halving
    while (group[i] != i) i = group[i] = group[group[i]];
    return i;
  }
  void unite(uint32_t a, uint32_t b) { group[find(a)] = find(b); }
  void difference(uint32_t from, uint32_t to, int64_t d[3]) const {
    for (int k = 0; k < 3; k++) d[k] = int64_t(n.position[to][k]) - n.position[from][k];
  }
  int64_t distance2(uint32_t a, uint32_t b) const {
    int64_t d[3];
    difference(a, b, d);
    return d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
  }
};

int64_t dot(const int64_t a[3], const int16_t b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
int32_t dot(const int16_t a[3], const int16_t b[3]) {
  return int32_t(a[0]) * b[0] + int32_t(a[1]) * b[1] + int32_t(a[2]) * b[2];
}
int64_t root(int64_t v) { return int64_t(__builtin_sqrt(double(v))); }  // v < 2^53: exact argument
int64_t absolute(int64_t v) { return v < 0 ? -v : v; }

void allocate(Gaps& g, Arena& a, uint32_t n) {
  uint32_t buckets = 1;
  while (buckets < n) buckets *= 2;
  g.hash_mask = buckets - 1;
  g.link_capacity = 2 * n;
  g.corner_capacity = n + 2 * g.link_capacity;
  g.diagonal_capacity = 2 * g.corner_capacity;
  g.loop = a.take<uint32_t>(n);
  g.place = a.take<uint32_t>(n);
  g.loop_length = a.take<uint32_t>(n);
  g.nearest = a.take<uint32_t>(n);
  g.face_of_border = a.take<uint32_t>(n);
  g.degree = a.take<uint32_t>(n);
  g.slot_begin = a.take<uint32_t>(uint64_t(n) + 1);
  g.diagonals = a.take<uint32_t>(n);
  g.mark = a.take<uint32_t>(n);
  g.outward = a.take<int16_t[3]>(n);
  g.open_corner = a.take<uint8_t>(n);
  g.cell_begin = a.take<uint32_t>(uint64_t(buckets) + 1);
  g.cell_nodes = a.take<uint32_t>(n);
  g.group = a.take<uint32_t>(n);
  g.links = a.take<Link>(g.link_capacity);
  g.slots = a.take<Slot>(uint64_t(g.link_capacity) * 2);
  g.diagonal = a.take<Diagonal>(g.diagonal_capacity);
  g.face = a.take<uint32_t>(g.corner_capacity);
  g.self = a.take<uint32_t>(uint64_t(g.link_capacity) * 2);
}

// --- borders ---

void trace_loops(Gaps& g) {
  for (uint32_t i = 0; i < g.count; i++) g.loop[i] = kNone;
  uint32_t loops = 0;
  for (uint32_t i = 0; i < g.count; i++) {
    if (g.loop[i] != kNone) continue;
    uint32_t place = 0, v = i;
    do {
      g.loop[v] = loops;
      g.place[v] = place++;
      v = g.n.next[v];
    } while (v != i);
    g.loop_length[loops++] = place;
  }
}

// Steps between two nodes of a loop, the short way round.
uint32_t steps_apart(const Gaps& g, uint32_t u, uint32_t v) {
  const uint32_t d = g.place[u] > g.place[v] ? g.place[u] - g.place[v] : g.place[v] - g.place[u];
  const uint32_t rest = g.loop_length[g.loop[u]] - d;
  return d < rest ? d : rest;
}

// The direction away from the patch, in its surface: tangent of the border x normal.
void find_outward(Gaps& g) {
  for (uint32_t v = 0; v < g.count; v++) {
    int64_t t[3], c[3];
    g.difference(g.n.prev[v], g.n.next[v], t);
    const int64_t m[3] = {g.n.normal[v][0], g.n.normal[v][1], g.n.normal[v][2]};
    cross(t, m, c);
    unit_vector(c, g.outward[v]);
  }
}

// --- nearest facing node ---

uint32_t hash_cell(const Gaps& g, int32_t x, int32_t y, int32_t z) {
  return (uint32_t(x) * 73856093u ^ uint32_t(y) * 19349663u ^ uint32_t(z) * 83492791u) & g.hash_mask;
}

int32_t cell_of(const Gaps& g, int32_t coordinate) {
  return int32_t((coordinate + 2 * kCoordinateLimit) / (g.reach / 2));
}

// Sorts the nodes into hashed cells of half the reach by counting.
void build_cells(Gaps& g) {
  memset(g.cell_begin, 0, (size_t(g.hash_mask) + 2) * sizeof(uint32_t));
  for (int pass = 0; pass < 2; pass++) {
    for (uint32_t v = g.count; v-- > 0;) {
      const int32_t* p = g.n.position[v];
      const uint32_t h = hash_cell(g, cell_of(g, p[0]), cell_of(g, p[1]), cell_of(g, p[2]));
      if (pass == 0)
        g.cell_begin[h + 1]++;
      else
        g.cell_nodes[--g.cell_begin[h + 1]] = v;
    }
    if (pass == 0)
      for (uint32_t i = 0; i <= g.hash_mask; i++) g.cell_begin[i + 1] += g.cell_begin[i];
  }
  // each begin was moved down to its bucket's start in place i + 1: shift back
  for (uint32_t i = 0; i <= g.hash_mask; i++) g.cell_begin[i] = g.cell_begin[i + 1];
  g.cell_begin[g.hash_mask + 1] = g.count;
}

bool neighbouring_pixels(const Gaps& g, uint32_t u, uint32_t v) {
  if (g.n.patch[u] != g.n.patch[v]) return false;
  const int dx = int(g.n.pixel[u][0]) - g.n.pixel[v][0], dy = int(g.n.pixel[u][1]) - g.n.pixel[v][1];
  return dx >= -1 && dx <= 1 && dy >= -1 && dy <= 1;
}

// Gaps are up to about a pixel of either patch wide, more on slopes: 3.5 of the mean spacing is within reach.
bool within_reach(const Gaps& g, uint32_t v, uint32_t u, int64_t d2) {
  const int64_t r = (int64_t(g.n.spacing[v]) + g.n.spacing[u]) * 7;
  return d2 * 16 <= r * r;
}

constexpr int64_t kCannotFace = INT64_MAX;

// How far u is from v as its partner over a gap: the squared distance, nine times as much where their normals
// are more than about 107 degrees apart or one lies above the other (the two sides of a thin sheet).
// kCannotFace if they are out of reach, near along one border, or one is not on the other's outer side.
int64_t facing_distance(const Gaps& g, uint32_t v, uint32_t u, int64_t d2) {
  if (!within_reach(g, v, u, d2)) return kCannotFace;
  if (g.loop[v] == g.loop[u] && steps_apart(g, u, v) < 5) return kCannotFace;
  int64_t d[3];
  g.difference(v, u, d);
  const int64_t length = root(d2) * kUnit;
  if (dot(d, g.outward[v]) * 20 < -3 * length || dot(d, g.outward[u]) * 20 > 3 * length) return kCannotFace;
  const int64_t hv = absolute(dot(d, g.n.normal[v])), hu = absolute(dot(d, g.n.normal[u]));
  const bool above = hv * 10 > 9 * length && hu * 10 > 9 * length;
  const bool turned = int64_t(dot(g.n.normal[v], g.n.normal[u])) * 10 < -3 * int64_t(kUnit) * kUnit;
  return above || turned ? 9 * d2 : d2;
}

// Calls visit(u) for the nodes in the cells of a ring (Chebyshev distance) around v's cell.
template <class Visit>
void visit_ring(const Gaps& g, uint32_t v, int ring, Visit visit) {
  const int32_t* p = g.n.position[v];
  const int32_t cx = cell_of(g, p[0]), cy = cell_of(g, p[1]), cz = cell_of(g, p[2]);
  for (int z = -ring; z <= ring; z++)
    for (int y = -ring; y <= ring; y++) {
      const bool face = ring == 0 || z == ring || z == -ring || y == ring || y == -ring;
      for (int x = -ring; x <= ring; x += face ? 1 : 2 * ring) {
        const uint32_t h = hash_cell(g, cx + x, cy + y, cz + z);
        for (uint32_t i = g.cell_begin[h]; i < g.cell_begin[h + 1]; i++) visit(g.cell_nodes[i]);
      }
    }
}

uint32_t nearest_facing(const Gaps& g, uint32_t v) {
  const int64_t cell = g.reach / 2;
  int64_t best = g.reach * g.reach;
  uint32_t found = kNone;
  int visits = 0;
  for (int ring = 0; ring <= 2 && visits < kMaxVisits; ring++) {
    if (ring > 0 && found != kNone) {  // nothing in this ring can be nearer than its inner wall
      int64_t wall = cell;
      for (int k = 0; k < 3; k++) {
        const int64_t in = (int64_t(g.n.position[v][k]) + 2 * kCoordinateLimit) % cell;
        const int64_t low = in < cell - in ? in : cell - in;
        wall = low < wall ? low : wall;
      }
      wall += (ring - 1) * cell;
      if (wall * wall > best) break;
    }
    visit_ring(g, v, ring, [&](uint32_t u) {
      if (u == v || visits++ >= kMaxVisits) return;
      int64_t d2 = g.distance2(v, u);
      // of equally near ones the first in number, so that the order of visits does not matter
      if (d2 > best || (d2 == best && u >= found) || neighbouring_pixels(g, u, v)) return;
      d2 = facing_distance(g, v, u, d2);
      if (d2 > best || (d2 == best && u >= found)) return;
      best = d2;
      found = u;
    });
  }
  return found;
}

// --- links ---

bool add_link(Gaps& g, uint32_t a, uint32_t b) {
  if (g.link_count == g.link_capacity || g.degree[a] == kMaxDegree || g.degree[b] == kMaxDegree) return false;
  g.degree[a]++, g.degree[b]++;
  g.links[g.link_count++] = {a, b};
  return true;
}

// Lists the ends of the links at each node.
void build_slots(Gaps& g) {
  memset(g.slot_begin, 0, (size_t(g.count) + 1) * sizeof(uint32_t));
  for (uint32_t i = 0; i < g.link_count; i++)
    g.slot_begin[g.links[i].a + 1]++, g.slot_begin[g.links[i].b + 1]++;
  for (uint32_t v = 0; v < g.count; v++) g.slot_begin[v + 1] += g.slot_begin[v];
  for (uint32_t v = 0; v < g.count; v++) g.mark[v] = g.slot_begin[v];
  for (uint32_t i = 0; i < g.link_count; i++) {
    const Link& l = g.links[i];
    const uint32_t s = g.mark[l.a]++, t = g.mark[l.b]++;
    g.slots[s] = {l.b, t, kNone, false};
    g.slots[t] = {l.a, s, kNone, false};
  }
}

void kill(Gaps& g, uint32_t slot) { g.slots[slot].dead = g.slots[g.slots[slot].twin].dead = true; }

// Along a border, the partners on the other side must come in reverse order. Of two links that do not, the
// longer goes.
void kill_crossings(Gaps& g) {
  for (uint32_t v = 0; v < g.count; v++) {
    uint32_t w = v;
    for (int step = 1; step <= kCrossingReach; step++) {
      w = g.n.next[w];
      if (w == v) break;
      for (uint32_t i = g.slot_begin[v]; i < g.slot_begin[v + 1]; i++)
        for (uint32_t j = g.slot_begin[w]; j < g.slot_begin[w + 1] && !g.slots[i].dead; j++) {
          if (g.slots[j].dead || g.slots[i].twin == j) continue;
          const uint32_t a = g.slots[i].to, b = g.slots[j].to;
          if (g.loop[a] != g.loop[b]) continue;
          const uint32_t length = g.loop_length[g.loop[a]];
          const uint32_t ahead =
              g.place[b] >= g.place[a] ? g.place[b] - g.place[a] : g.place[b] + length - g.place[a];
          if (ahead < 1 || ahead > 8 || ahead >= length / 2) continue;
          kill(g, g.distance2(v, a) > g.distance2(w, b) ? i : j);
        }
    }
  }
}

void compact_links(Gaps& g) {
  uint32_t kept = 0;
  for (uint32_t v = 0; v < g.count; v++)
    for (uint32_t i = g.slot_begin[v]; i < g.slot_begin[v + 1]; i++)
      if (!g.slots[i].dead && g.slots[i].twin > i) g.self[kept++] = i;
  for (uint32_t v = 0; v < g.count; v++) g.degree[v] = 0;
  const uint32_t n = kept;
  g.link_count = 0;
  uint32_t k = 0;
  for (uint32_t v = 0; v < g.count; v++)
    for (; k < n && g.self[k] < g.slot_begin[v + 1]; k++) add_link(g, v, g.slots[g.self[k]].to);
}

void reset_groups(Gaps& g) {
  for (uint32_t i = 0; i < g.components; i++) g.group[i] = i;
}

bool linked(const Gaps& g, uint32_t a, uint32_t b) {
  for (uint32_t i = g.slot_begin[a]; i < g.slot_begin[a + 1]; i++)
    if (g.slots[i].to == b) return true;
  return false;
}

// Pieces that no link joins to the largest one look again, twice as far and less choosy.
void link_islands(Gaps& g) {
  reset_groups(g);
  for (uint32_t i = 0; i < g.link_count; i++)
    g.unite(g.n.component[g.links[i].a], g.n.component[g.links[i].b]);
  uint32_t* size = g.self;  // by component, as scratch; components <= count
  for (uint32_t c = 0; c < g.components; c++) size[c] = 0;
  for (uint32_t v = 0; v < g.count; v++) size[g.find(g.n.component[v])]++;
  uint32_t largest = 0;
  for (uint32_t c = 0; c < g.components; c++)
    if (size[c] > size[largest]) largest = c;
  int64_t* best = reinterpret_cast<int64_t*>(g.diagonal);  // by component, as scratch
  for (uint32_t c = 0; c < g.components; c++) best[c] = 4 * g.reach * g.reach;
  auto stray = [&](uint32_t v) { return g.find(g.n.component[v]) != g.find(largest); };
  for (uint32_t v = 0; v < g.count; v++) {
    g.nearest[v] = kNone;
    if (!stray(v)) continue;
    int64_t nearest = 4 * g.reach * g.reach;
    const uint32_t own = g.find(g.n.component[v]);
    int visits = 0;
    for (int ring = 0; ring <= 4 && visits < kMaxVisits; ring++)
      visit_ring(g, v, ring, [&](uint32_t u) {
        if (visits++ >= kMaxVisits) return;
        const int64_t d2 = g.distance2(v, u);
        if (d2 > nearest || (d2 == nearest && u >= g.nearest[v])) return;
        if (g.find(g.n.component[u]) == own) return;
        if (!within_reach(g, v, u, d2 / 4) || dot(g.n.normal[u], g.n.normal[v]) < -kUnit * kUnit / 2) return;
        nearest = d2;
        g.nearest[v] = u;
      });
    if (nearest < best[own]) best[own] = nearest;
  }
  for (uint32_t v = 0; v < g.count; v++) {
    const uint32_t u = g.nearest[v];
    if (u == kNone || g.distance2(v, u) > 4 * best[g.find(g.n.component[v])]) continue;
    if (linked(g, v, u) || (g.nearest[u] == v && u < v)) continue;
    add_link(g, v, u);
  }
}

// Takes the links out that the stream says are wrong.
bool drop_links(Gaps& g) {
  if (GapTrace* t = g.options.trace)
    for (t->link_count = 0; t->link_count < g.link_count && t->link_count < t->link_capacity;
         t->link_count++) {
      const Link& l = g.links[t->link_count];
      t->links[t->link_count][0] = g.n.vertex[l.a];
      t->links[t->link_count][1] = g.n.vertex[l.b];
    }
  if (!g.options.seams) return true;
  g.seams.advance();
  uint32_t kept = 0;
  for (uint32_t i = 0; i < g.link_count; i++) {
    if (g.seams.next == i + 1)
      g.seams.advance();
    else
      g.links[kept++] = g.links[i];
  }
  g.link_count = kept;
  return g.seams.good && g.seams.next == 0;
}

// --- the cyclic order around a node ---

// The direction of a link at v in the plane orthogonal to the normal, as (cosine, sine) against the inward
// direction, scaled to 30 bits.
void link_angle(const Gaps& g, uint32_t v, uint32_t to, int64_t out[2]) {
  int64_t d[3], c[3];
  g.difference(v, to, d);
  const int64_t inward[3] = {-g.outward[v][0], -g.outward[v][1], -g.outward[v][2]};
  out[0] = (inward[0] * d[0] + inward[1] * d[1] + inward[2] * d[2]) * kUnit;
  cross(inward, d, c);
  out[1] = dot(c, g.n.normal[v]);
  while (absolute(out[0]) >= 1 << 30 || absolute(out[1]) >= 1 << 30) out[0] /= 2, out[1] /= 2;
}

// Whether direction a comes before b, counter-clockwise from the inward direction.
bool angle_before(const int64_t a[2], const int64_t b[2]) {
  const int ha = a[1] < 0 || (a[1] == 0 && a[0] < 0), hb = b[1] < 0 || (b[1] == 0 && b[0] < 0);
  if (ha != hb) return ha < hb;
  return a[0] * b[1] - a[1] * b[0] > 0;
}

void sort_slots(Gaps& g) {
  for (uint32_t v = 0; v < g.count; v++) {
    const uint32_t begin = g.slot_begin[v], n = g.slot_begin[v + 1] - begin;  // n <= kMaxDegree
    int64_t angle[kMaxDegree][2];
    uint32_t order[kMaxDegree], to[kMaxDegree], twin[kMaxDegree];
    for (uint32_t i = 0; i < n; i++) {
      link_angle(g, v, g.slots[begin + i].to, angle[i]);
      uint32_t j = i;
      while (j > 0 && angle_before(angle[i], angle[order[j - 1]])) order[j] = order[j - 1], j--;
      order[j] = i;
    }
    for (uint32_t i = 0; i < n; i++) to[i] = g.slots[begin + i].to, twin[i] = g.slots[begin + i].twin;
    for (uint32_t i = 0; i < n; i++) {
      g.slots[begin + i].to = to[order[i]];
      g.slots[begin + i].twin = twin[order[i]];
    }
    for (uint32_t i = 0; i < n; i++) g.slots[g.slots[begin + i].twin].twin = begin + i;
  }
}

// The next lower live slot at a node, or kNone for the border.
uint32_t below(const Gaps& g, uint32_t v, uint32_t slot) {
  while (slot-- > g.slot_begin[v])
    if (!g.slots[slot].dead) return slot;
  return kNone;
}
uint32_t top(const Gaps& g, uint32_t v) { return below(g, v, g.slot_begin[v + 1]); }

// A place on a face's rim: leaving `node` by link `slot`, or by the border (backwards) if kNone.
struct Corner {
  uint32_t node, slot;
  bool operator!=(const Corner& o) const { return node != o.node || slot != o.slot; }
};

Corner step(const Gaps& g, Corner c) {
  if (c.slot == kNone) {
    const uint32_t u = g.n.prev[c.node];
    return {u, top(g, u)};
  }
  const uint32_t u = g.slots[c.slot].to;
  return {u, below(g, u, g.slots[c.slot].twin)};
}

// Walks around the face at `start`, marks it with a new number, and lists the slots that have it on both
// sides (one of the two) from self[first] on. Returns the end of the list.
uint32_t walk_face(Gaps& g, Corner start, uint32_t first) {
  const uint32_t number = g.face_count++;
  uint32_t end = first;
  Corner c = start;
  do {
    if (c.slot == kNone) {
      g.face_of_border[c.node] = number;
    } else {
      g.slots[c.slot].face = number;
      if (g.slots[g.slots[c.slot].twin].face == number) g.self[end++] = c.slot;
    }
    g.work--;
    c = step(g, c);
  } while (c != start);
  return end;
}

int64_t slot_length(const Gaps& g, uint32_t s) {
  return g.distance2(g.slots[s].to, g.slots[g.slots[s].twin].to);
}

// Heap sort, longest first, by number where equal.
void sort_longest_first(const Gaps& g, uint32_t* s, uint32_t n) {
  auto before = [&](uint32_t a, uint32_t b) {
    const int64_t la = slot_length(g, a), lb = slot_length(g, b);
    return la != lb ? la > lb : a < b;
  };
  auto sift = [&](uint32_t i, uint32_t end) {  // the root of the heap comes last
    for (uint32_t k; (k = 2 * i + 1) < end; i = k) {
      if (k + 1 < end && before(s[k], s[k + 1])) k++;
      if (!before(s[i], s[k])) return;
      const uint32_t t = s[i];
      s[i] = s[k], s[k] = t;
    }
  };
  for (uint32_t i = n / 2; i-- > 0;) sift(i, n);
  for (uint32_t end = n; end-- > 1;) {
    const uint32_t t = s[0];
    s[0] = s[end], s[end] = t;
    sift(0, end);
  }
}

// Whether a slot's link runs inside one face, with that face on both sides.
bool self_crossing(const Gaps& g, uint32_t s) { return g.slots[s].face == g.slots[g.slots[s].twin].face; }

void unite_ends(Gaps& g, uint32_t s) {
  g.unite(g.n.component[g.slots[s].to], g.n.component[g.slots[g.slots[s].twin].to]);
}

// Mends one face that has links on both of its sides (self[begin] .. self[end - 1]): such a link is a wrong
// crossing, unless nothing else joins its two pieces. The longest wrong one is removed, which cuts the face
// in two; both parts are put on the stack.
void mend_face(Gaps& g, uint32_t begin, uint32_t end) {
  sort_longest_first(g, g.self + begin, end - begin);
  for (uint32_t i = begin; i < end; i++) {
    const uint32_t s = g.self[i], t = g.slots[s].twin;
    if (g.slots[s].dead || !self_crossing(g, s)) continue;
    if (g.find(g.n.component[g.slots[s].to]) != g.find(g.n.component[g.slots[t].to])) {
      unite_ends(g, s);
      continue;
    }
    kill(g, s);
    if (g.work <= 0) continue;  // no time to walk again: all wrong ones go
    const uint32_t v = g.slots[t].to, u = g.slots[s].to;
    const uint32_t middle = walk_face(g, {v, below(g, v, s)}, end),
                   last = walk_face(g, {u, below(g, u, t)}, middle);
    for (uint32_t k = i + 1; k < end; k++)
      if (!g.slots[g.self[k]].dead && !self_crossing(g, g.self[k])) unite_ends(g, g.self[k]);
    // the two lists are parts of the old one, without s: both fit into its place
    const uint32_t first_count = middle - end, second_count = last - middle;
    memmove(g.self + begin, g.self + end, size_t(first_count + second_count) * sizeof(uint32_t));
    // the stack of faces to mend
    if (first_count) g.links[g.link_count++] = {begin, begin + first_count};
    if (second_count) g.links[g.link_count++] = {begin + first_count, begin + first_count + second_count};
    return;
  }
}

void mend_faces(Gaps& g) {
  for (uint32_t v = 0; v < g.count; v++) g.face_of_border[v] = kNone;
  reset_groups(g);
  g.face_count = 0;
  g.link_count = 0;  // the links are in the slots now; the array is a stack of ranges of self
  uint32_t end = 0;
  auto start = [&](Corner c) {
    const uint32_t first = end;
    end = walk_face(g, c, first);
    if (end > first) g.links[g.link_count++] = {first, end};
  };
  for (uint32_t v = 0; v < g.count; v++)
    if (g.face_of_border[v] == kNone) start({v, kNone});
  for (uint32_t s = 0; s < g.slot_begin[g.count]; s++)
    if (!g.slots[s].dead && g.slots[s].face == kNone) start({g.slots[g.slots[s].twin].to, s});
  for (uint32_t s = 0; s < g.slot_begin[g.count]; s++)
    if (!g.slots[s].dead && !self_crossing(g, s)) unite_ends(g, s);
  // the last range of the stack ends where the used part of self ends, and what mending leaves takes its
  // place
  while (g.link_count > 0) {
    const Link range = g.links[--g.link_count];
    mend_face(g, range.a, range.b);
  }
}

// --- faces ---

bool has_edge(const Gaps& g, uint32_t a, uint32_t b) {
  if (g.n.next[a] == b || g.n.prev[a] == b || neighbouring_pixels(g, a, b)) return true;
  for (uint32_t i = g.slot_begin[a]; i < g.slot_begin[a + 1]; i++)
    if (!g.slots[i].dead && g.slots[i].to == b) return true;
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
  int64_t u[3], v[3], w[3];
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

// The cost of cutting off corner b with neighbours a and c: a short new edge and a triangle that lies in the
// surface. rest: the fourth corner of a quadrilateral, whose other triangle counts as well, or kNone.
int64_t ear_cost(const Gaps& g, uint32_t a, uint32_t b, uint32_t c, uint32_t rest) {
  if (a == c || has_edge(g, a, c)) return kNoEar;
  const int64_t al = alignment(g, a, b, c);
  int64_t cost = root(g.distance2(a, c)) * (10 * kUnit + 6 * (kUnit - al)) / 10;
  if (al < 0) cost += 3 * g.reach * kUnit;
  if (rest == kNone) return cost;
  const int64_t other = alignment(g, a, c, rest);
  if (other < 0) cost += 3 * g.reach * kUnit;
  return cost * (10 * kUnit + 3 * (kUnit - other)) / (10 * kUnit);
}

// Cuts off ears until a triangle is left (returns 0) or none can be cut. Returns the number of corners left
// in q.
uint32_t clip_ears(Gaps& g, uint32_t* q, uint32_t m, bool& room) {
  int64_t cost[kMaxEarFace];
  auto cost_at = [&](uint32_t i) {
    const uint32_t rest = m == 4 ? q[(i + 2) % m] : kNone;
    return ear_cost(g, q[(i + m - 1) % m], q[i], q[(i + 1) % m], rest);
  };
  for (uint32_t i = 0; i < m; i++) cost[i] = cost_at(i);
  while (m > 3) {
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
    if (m == 4) {
      for (uint32_t i = 0; i < m; i++) cost[i] = cost_at(i);
    } else {
      cost[best % m] = cost_at(best % m);
      cost[(best + m - 1) % m] = cost_at((best + m - 1) % m);
    }
  }
  if (q[0] == q[1] || q[1] == q[2] || q[2] == q[0]) return m;
  room = room && add_triangle(g, g.n.vertex[q[0]], g.n.vertex[q[1]], g.n.vertex[q[2]]);
  return 0;
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

// A corner moved a quarter of the grid's spacing towards the middle of its face.
void move_inwards(const Gaps& g, uint32_t node, const int64_t middle[3], int64_t out[3]) {
  int64_t d[3], square = 0;
  for (int k = 0; k < 3; k++) {
    d[k] = middle[k] - g.n.position[node][k];
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
    move_inwards(g, q[i], middle, p);
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
  if (m <= kMaxEarFace) m = clip_ears(g, q, m, room);
  return room && (m == 0 || close_around_middle(g, q, m, false));
}

relief_status close_faces(Gaps& g) {
  for (uint32_t v = 0; v < g.count; v++) {
    g.face_of_border[v] = g.diagonals[v] = kNone;
    g.open_corner[v] = 0;
    g.mark[v] = 0;
  }
  for (uint32_t s = 0; s < g.slot_begin[g.count]; s++) g.slots[s].face = kNone;
  const GapOptions& o = g.options;
  NumberList holes = {g.seams.p, g.seams.end};
  if (o.seams) holes.advance();
  g.face_count = g.diagonal_count = g.mark_count = 0;
  auto close = [&](Corner start) {
    uint32_t m = 0;
    Corner c = start;
    do {
      g.face[m++] = c.node;
      if (c.slot == kNone)
        g.face_of_border[c.node] = g.face_count;
      else
        g.slots[c.slot].face = g.face_count;
      c = step(g, c);
    } while (c != start);
    g.face_count++;
    if (o.trace && o.trace->count < o.trace->capacity)
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
    if (g.face_of_border[v] == kNone) room = close({v, kNone});
  for (uint32_t s = 0; s < g.slot_begin[g.count] && room; s++)
    if (!g.slots[s].dead && g.slots[s].face == kNone) room = close({g.slots[g.slots[s].twin].to, s});
  return !room ? RELIEF_ERROR_OUTPUT : holes.good ? RELIEF_OK : RELIEF_ERROR_CORRUPT;
}

}  // namespace

uint64_t gap_memory_bytes(uint32_t n) {
  Arena a = {nullptr};
  const Nodes none = {};
  MeshWriter mesh = {};
  const GapOptions options = {};
  Gaps g(none, options, mesh);
  allocate(g, a, n);
  return a.used;
}

relief_status close_gaps(const Nodes& nodes, uint32_t components, const GapOptions& options, MeshWriter& mesh,
                         void* memory) {
  Gaps g(nodes, options, mesh);
  g.count = nodes.count;
  g.components = components;
  if (g.count == 0) return RELIEF_OK;
  g.reach = int64_t(options.spacing) * 7 / 2;
  if (g.reach < 2) g.reach = 2;
  Arena arena = {static_cast<uint8_t*>(memory)};
  allocate(g, arena, nodes.count);
  g.work = 64 * int64_t(g.corner_capacity);
  trace_loops(g);
  find_outward(g);
  build_cells(g);
  for (uint32_t v = 0; v < g.count; v++) g.nearest[v] = nearest_facing(g, v), g.degree[v] = 0;
  g.link_count = 0;
  for (uint32_t v = 0; v < g.count; v++) {
    const uint32_t u = g.nearest[v];
    if (u == kNone || (g.nearest[u] == v && u < v)) continue;
    add_link(g, v, u);
  }
  build_slots(g);
  kill_crossings(g);
  compact_links(g);
  build_slots(g);
  link_islands(g);
  if (!drop_links(g)) return RELIEF_ERROR_CORRUPT;
  build_slots(g);
  sort_slots(g);
  mend_faces(g);
  return close_faces(g);
}

}  // namespace relief
