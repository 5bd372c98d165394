// Links between partners, and with them the surface's topology (4.2).
//
// A cyclic order of the links around each node is all that a surface takes (a rotation system): it tells the
// faces that links and borders cut the space between the patches into. At first every border loop is a face.
// Links are put in one by one, the shortest first. One that cuts a face in two is right, and so is one that
// joins two pieces that nothing joined before. One between two faces of one piece would make a handle: it is
// left out, unless the stream says that the surface has one there. So there are no handles but those the
// encoder knows of.
#include <string.h>

#include "gap_state.h"

namespace relief {
namespace {

// Refused beyond kMaxDegree links at a node.
void add_link(Gaps& g, uint32_t a, uint32_t b, int64_t length) {
  if (g.link_count == g.link_capacity || g.degree[a] == kMaxDegree || g.degree[b] == kMaxDegree) return;
  g.degree[a]++, g.degree[b]++;
  const int64_t rank = length * 4096 / (g.options.spacing + 1);
  g.links[g.link_count++] = {a, b, kNone, uint16_t(rank < 0xffff ? rank : 0xffff), LinkKind::kPlain};
}

void link_partners(Gaps& g) {
  g.link_count = 0;
  for (uint32_t v = 0; v < g.count; v++) g.degree[v] = 0;
  for (uint32_t v = 0; v < g.count; v++) {
    const uint32_t u = g.nearest[v];
    if (u == kNone || (g.nearest[u] == v && u < v)) continue;
    add_link(g, v, u, g.distance[v]);
  }
}

void trace_links(Gaps& g) {
  GapTrace* t = g.options.trace;
  if (!kTracing || !t) return;
  for (t->node_count = 0; t->node_count < g.count && t->node_count < t->node_capacity; t->node_count++)
    t->nodes[t->node_count] = g.n.vertex[t->node_count];
  for (t->link_count = 0; t->link_count < g.link_count && t->link_count < t->link_capacity; t->link_count++) {
    t->links[t->link_count][0] = g.links[t->link_count].a;
    t->links[t->link_count][1] = g.links[t->link_count].b;
  }
}

// The next list of the seams, numbers of links that are `kind`.
bool mark_links(Gaps& g, LinkKind kind) {
  for (g.seams.advance(); g.seams.next; g.seams.advance()) {
    if (g.seams.next > g.link_count) return false;
    g.links[g.seams.next - 1].kind = kind;
  }
  return g.seams.good;
}

bool linked(const Gaps& g, uint32_t a, uint32_t b) {
  const uint32_t u = g.nearest[a], w = g.nearest[b];
  return u == b || w == a;
}

// The next list of the seams, links to add: a node and how far the other one's number is from it. What could
// make an edge twice is left out.
bool add_links(Gaps& g) {
  for (g.seams.advance(); g.seams.next; g.seams.advance()) {
    const uint32_t a = g.seams.next - 1, ahead = g.seams.varint();
    if (a >= g.count || ahead == 0 || ahead >= g.count - a) return false;
    const uint32_t b = a + ahead, before = g.link_count;
    if (g.neighbouring_pixels(a, b) || linked(g, a, b)) continue;
    add_link(g, a, b, root(g.distance2(a, b)));
    if (g.link_count > before) g.links[before].kind = LinkKind::kHandle;
  }
  return g.seams.good;
}

// Lists the ends of the links at each node. None is on a rim until the link is put in.
void build_slots(Gaps& g) {
  memset(g.slot_begin, 0, (size_t(g.count) + 1) * sizeof(uint32_t));
  for (uint32_t i = 0; i < g.link_count; i++)
    g.slot_begin[g.links[i].a + 1]++, g.slot_begin[g.links[i].b + 1]++;
  for (uint32_t v = 0; v < g.count; v++) g.slot_begin[v + 1] += g.slot_begin[v];
  for (uint32_t v = 0; v < g.count; v++) g.mark[v] = g.slot_begin[v];
  for (uint32_t i = 0; i < g.link_count; i++) {
    const Link& l = g.links[i];
    const uint32_t s = g.mark[l.a]++, t = g.mark[l.b]++;
    g.slots[s] = {l.b, t, i};
    g.slots[t] = {l.a, s, i};
  }
}

// Steps along the border from a to b, or kNone if they are not near one another on one loop.
uint32_t steps_ahead(const Gaps& g, uint32_t a, uint32_t b) {
  constexpr uint32_t kNear = 16;
  if (g.loop[a] != g.loop[b]) return kNone;
  const uint32_t length = g.loop_length[g.loop[a]];
  const uint32_t ahead =
      g.place[b] >= g.place[a] ? g.place[b] - g.place[a] : g.place[b] + length - g.place[a];
  return ahead <= kNear && ahead < length / 2 ? ahead : kNone;
}

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

// Links to one border come in the reverse of its order, whatever the angles, which tell little where the
// surface is sharp; others by their angles.
bool slot_before(const Gaps& g, uint32_t a, const int64_t angle_a[2], uint32_t b, const int64_t angle_b[2]) {
  if (steps_ahead(g, b, a) != kNone) return true;
  if (steps_ahead(g, a, b) != kNone) return false;
  return angle_before(angle_a, angle_b);
}

void sort_slots(Gaps& g) {
  for (uint32_t v = 0; v < g.count; v++) {
    const uint32_t begin = g.slot_begin[v], n = g.slot_begin[v + 1] - begin;  // n <= kMaxDegree
    if (n < 2) continue;
    int64_t angle[kMaxDegree][2];
    uint32_t order[kMaxDegree];
    Slot old[kMaxDegree];
    for (uint32_t i = 0; i < n; i++) {
      old[i] = g.slots[begin + i];
      link_angle(g, v, old[i].to, angle[i]);
      uint32_t j = i;
      for (; j > 0 && slot_before(g, old[i].to, angle[i], old[order[j - 1]].to, angle[order[j - 1]]); j--)
        order[j] = order[j - 1];
      order[j] = i;
    }
    for (uint32_t i = 0; i < n; i++) g.slots[begin + i] = old[order[i]];
    for (uint32_t i = 0; i < n; i++) g.slots[g.slots[begin + i].twin].twin = begin + i;
  }
  for (uint32_t s = 0; s < g.slot_begin[g.count]; s++) g.links[g.slots[s].link].slot = s;
}

// Numbers of links, the shortest first, in g.self: two passes of a radix sort.
void sort_links(Gaps& g) {
  uint32_t *from = g.face, *to = g.self;
  for (uint32_t i = 0; i < g.link_count; i++) from[i] = i;
  for (int shift = 0; shift < 16; shift += 8) {
    uint32_t begin[257] = {0};
    for (uint32_t i = 0; i < g.link_count; i++) begin[(g.links[from[i]].rank >> shift & 255) + 1]++;
    for (int k = 0; k < 256; k++) begin[k + 1] += begin[k];
    for (uint32_t i = 0; i < g.link_count; i++) to[begin[g.links[from[i]].rank >> shift & 255]++] = from[i];
    uint32_t* const t = from;
    from = to, to = t;
  }
  if (from != g.self) memcpy(g.self, from, g.link_count * sizeof(uint32_t));
}

// --- faces in the making ---

// At first every border loop is a face, and no link is on a rim.
void start_faces(Gaps& g) {
  g.face_count = 0;
  for (uint32_t v = 0; v < g.count; v++) {
    g.next_corner[v] = g.n.prev[v];
    g.face_of_corner[v] = g.loop[v];
    if (g.loop[v] >= g.face_count) g.face_count = g.loop[v] + 1;
  }
  for (uint32_t s = 0; s < g.slot_begin[g.count]; s++) g.next_corner[g.corner_of(s)] = kNone;
}

// The corner from which a rim comes to the node where `slot` is, to leave by the slot once its link is put
// in: it comes by the link above, or by the border if there is none.
uint32_t corner_before(const Gaps& g, uint32_t node, uint32_t slot) {
  for (uint32_t above = slot + 1; above < g.slot_begin[node + 1]; above++)
    if (g.is_in(above)) return g.corner_of(g.slots[above].twin);
  return g.n.next[node];
}

void paint(Gaps& g, uint32_t start, uint32_t face) {
  uint32_t c = start;
  do {
    g.face_of_corner[c] = face;
    c = g.next_corner[c];
  } while (c != start);
}

// Whether the rim that leaves from x is at most as long as the one from y.
bool shorter_rim(Gaps& g, uint32_t x, uint32_t y) {
  const uint32_t x0 = x, y0 = y;
  for (;;) {
    x = g.next_corner[x];
    y = g.next_corner[y];
    g.work -= 2;
    if (x == x0) return true;
    if (y == y0) return false;
  }
}

bool is_big(const Gaps& g, uint32_t corner) {
  uint32_t c = corner;
  for (uint32_t i = 0; i < kBigFace; i++)
    if ((c = g.next_corner[c]) == corner) return false;
  return true;
}

void put_in(Gaps& g, Link& link) {
  const uint32_t s = link.slot, t = g.slots[s].twin, a = g.slots[t].to, b = g.slots[s].to;
  const uint32_t before_a = corner_before(g, a, s), before_b = corner_before(g, b, t);
  const uint32_t at_a = g.next_corner[before_a], at_b = g.next_corner[before_b];
  const uint32_t leave_a = g.corner_of(s), leave_b = g.corner_of(t);
  const uint32_t fa = g.face_of_corner[at_a], fb = g.face_of_corner[at_b];
  const uint32_t pa = g.find(g.n.component[a]), pb = g.find(g.n.component[b]);
  const bool cuts = fa == fb;
  // Without seams, two big faces that a link refused before could join are the ends of a tunnel: lids over
  // them would err by its width.
  const bool tunnel =
      !g.options.seams && link.kind == LinkKind::kRefused && is_big(g, at_a) && is_big(g, at_b);
  if (!cuts && pa == pb && link.kind != LinkKind::kHandle && !tunnel) {
    link.kind = LinkKind::kRefused;
    return;
  }
  uint32_t face = fa;
  if (!cuts) {  // two faces become one
    const bool a_shorter = shorter_rim(g, at_a, at_b);
    face = a_shorter ? fb : fa;
    paint(g, a_shorter ? at_a : at_b, face);
  }
  g.next_corner[before_a] = leave_a;
  g.next_corner[leave_a] = at_b;
  g.next_corner[before_b] = leave_b;
  g.next_corner[leave_b] = at_a;
  g.face_of_corner[leave_a] = g.face_of_corner[leave_b] = face;
  if (cuts) {
    paint(g, shorter_rim(g, leave_a, leave_b) ? leave_a : leave_b, g.face_count++);
    link.kind = LinkKind::kIn;
    return;
  }
  link.kind = pa == pb ? LinkKind::kMade : LinkKind::kIn;
  g.unite(pa, pb);
}

}  // namespace

bool make_links(Gaps& g) {
  link_partners(g);
  trace_links(g);
  if (g.options.seams &&
      !(mark_links(g, LinkKind::kDropped) && mark_links(g, LinkKind::kHandle) && add_links(g)))
    return false;
  build_slots(g);
  sort_slots(g);
  sort_links(g);
  for (uint32_t c = 0; c < g.components; c++) g.group[c] = c;
  start_faces(g);
  // handles when all else is in, and then again what was refused: a handle lets in the links beside it
  const LinkKind passes[] = {LinkKind::kPlain, LinkKind::kHandle, LinkKind::kRefused};
  for (const LinkKind kind : passes)
    for (uint32_t i = 0; i < g.link_count && g.work > 0; i++) {
      Link& link = g.links[g.self[i]];
      if (link.kind == kind) put_in(g, link);
    }
  if (GapTrace* t = g.options.trace; kTracing && t)
    for (uint32_t i = 0; i < t->link_count; i++) t->kind[i] = g.links[i].kind;
  return true;
}

}  // namespace relief
