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
  uint32_t* const degree = g.slot_begin + 1;  // until build_slots
  if (g.link_count == g.link_capacity || degree[a] == kMaxDegree || degree[b] == kMaxDegree) return;
  degree[a]++, degree[b]++;
  const int64_t rank = length >> g.rank_shift;
  g.links[g.link_count] = {{a, b}, {}, uint8_t(rank < 255 ? rank : 255), LinkKind::kPlain};
  g.link_count++;
}

void link_partners(Gaps& g) {
  g.link_count = 0;
  g.rank_shift = 0;
  while (g.options.spacing >> g.rank_shift >= 16) g.rank_shift++;
  memset(g.slot_begin, 0, (size_t(g.count) + 1) * sizeof(uint32_t));
  for (uint32_t v = 0; v < g.count; v++) {
    const uint32_t u = g.n[v].nearest;
    if (u == kNone || (g.n[u].nearest == v && u < v)) continue;
    add_link(g, v, u, g.distance[v]);
  }
}

void trace_links(Gaps& g) {
  GapTrace* t = g.options.trace;
  if (!kTracing || !t) return;
  for (t->node_count = 0; t->node_count < g.count && t->node_count < t->node_capacity; t->node_count++)
    t->nodes[t->node_count] = g.n[t->node_count].vertex;
  for (t->link_count = 0; t->link_count < g.link_count && t->link_count < t->link_capacity; t->link_count++) {
    memcpy(t->links[t->link_count], g.links[t->link_count].node, sizeof t->links[0]);
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
  const uint32_t u = g.n[a].nearest, w = g.n[b].nearest;
  return u == b || w == a;
}

// The next list of the seams, links to add: a node and how far the other one's number is from it. What could
// make an edge twice is left out.
bool add_links(Gaps& g) {
  for (g.seams.advance(); g.seams.next; g.seams.advance()) {
    const uint32_t a = g.seams.next - 1, ahead = g.seams.varint();
    if (a >= g.count || ahead == 0 || ahead >= g.count - a) return false;
    const uint32_t b = a + ahead, before = g.link_count;
    if (neighbouring_pixels(g.n[a], g.n[b]) || linked(g, a, b)) continue;
    add_link(g, a, b, root(distance2(g.n[a], g.n[b])));
    if (g.link_count > before) g.links[before].kind = LinkKind::kHandle;
  }
  return g.seams.good;
}

// Lists the ends of the links at each node, the last link first: mostly that is their order around it.
void build_slots(Gaps& g) {
  for (uint32_t v = 0; v < g.count; v++) {
    g.slot_begin[v + 1] += g.slot_begin[v];
    g.mark[v] = g.slot_begin[v];
  }
  for (uint32_t i = g.link_count; i-- > 0;) {
    Link& l = g.links[i];
    for (int end = 0; end < 2; end++) l.slot[end] = g.mark[l.node[end]]++;
    for (int end = 0; end < 2; end++) g.slots[l.slot[end]] = {l.node[1 - end], l.slot[1 - end], i};
  }
}

// Steps along the border from a to b, or kNone if they are not near one another on one loop.
uint32_t steps_ahead(const Gaps& g, uint32_t a, uint32_t b) {
  constexpr uint32_t kNear = 16;
  if (g.n[a].loop != g.n[b].loop) return kNone;
  const uint32_t length = g.n.loop_length[g.n[a].loop];
  const uint32_t ahead =
      g.n[b].place >= g.n[a].place ? g.n[b].place - g.n[a].place : g.n[b].place + length - g.n[a].place;
  return ahead <= kNear && ahead < length / 2 ? ahead : kNone;
}

// The direction of a link at v in the plane orthogonal to the normal, as (cosine, sine) against the inward
// direction, scaled to 30 bits.
void link_angle(const Gaps& g, uint32_t v, uint32_t to, int64_t out[2]) {
  int64_t d[3], c[3];
  difference(g.n[v], g.n[to], d);
  const int64_t inward[3] = {-g.n[v].outward[0], -g.n[v].outward[1], -g.n[v].outward[2]};
  out[0] = (inward[0] * d[0] + inward[1] * d[1] + inward[2] * d[2]) * kUnit;
  cross(inward, d, c);
  out[1] = dot(c, g.n[v].normal);
  const int bits = bits_of(absolute(out[0]) | absolute(out[1]) | 1);
  if (bits <= 30) return;
  for (int k = 0; k < 2; k++) out[k] = scale_down(out[k], bits - 30);
}

// Whether direction a comes before b, counter-clockwise from the inward direction.
bool angle_before(const int64_t a[2], const int64_t b[2]) {
  const int ha = a[1] < 0 || (a[1] == 0 && a[0] < 0), hb = b[1] < 0 || (b[1] == 0 && b[0] < 0);
  if (ha != hb) return ha < hb;
  return a[0] * b[1] - a[1] * b[0] > 0;
}

// Whether at node v the link to x comes before that to y. Links to one border come in the reverse of its
// order, whatever the angles, which tell little where the surface is sharp; others by their angles.
bool link_before(const Gaps& g, uint32_t v, uint32_t x, uint32_t y) {
  if (steps_ahead(g, y, x) != kNone) return true;
  if (steps_ahead(g, x, y) != kNone) return false;
  int64_t angle_x[2], angle_y[2];
  link_angle(g, v, x, angle_x);
  link_angle(g, v, y, angle_y);
  return angle_before(angle_x, angle_y);
}

// Moves a slot, and what refers to it.
void move_slot(Gaps& g, uint32_t v, const Slot& slot, uint32_t to) {
  g.slots[to] = slot;
  g.slots[slot.twin].twin = to;
  Link& link = g.links[slot.link];
  link.slot[link.node[1] == v] = to;
}

void sort_slots(Gaps& g) {
  for (uint32_t v = 0; v < g.count; v++) {
    const uint32_t begin = g.slot_begin[v], end = g.slot_begin[v + 1];  // at most kMaxDegree of them
    for (uint32_t i = begin + 1; i < end; i++) {
      const Slot slot = g.slots[i];
      uint32_t j = i;
      for (; j > begin && link_before(g, v, slot.to, g.slots[j - 1].to); j--)
        move_slot(g, v, g.slots[j - 1], j);
      if (j < i) move_slot(g, v, slot, j);
    }
  }
}

// The shortest link first, by rank; those of one rank along the borders.
void sort_links(Gaps& g) {
  uint32_t begin[257] = {0};
  for (uint32_t i = 0; i < g.link_count; i++) begin[g.links[i].rank + 1]++;
  for (int k = 0; k < 256; k++) begin[k + 1] += begin[k];
  for (uint32_t i = 0; i < g.link_count; i++) g.by_rank[begin[g.links[i].rank]++] = i;
}

// --- faces in the making ---

// At first every border loop is a face, and no link is on a rim.
void start_faces(Gaps& g) {
  g.face_count = g.n.loop_count;
  for (uint32_t v = 0; v < g.count; v++) {
    g.corner[v].next = g.n[v].prev;
    g.corner[v].face = g.n[v].loop;
    g.next[v] = g.n[v].next;
  }
  for (uint32_t s = 0; s < g.slot_begin[g.count]; s++) g.corner[g.corner_of(s)].next = kNone;
}

// The corner from which a rim comes to the node where `slot` is, to leave by the slot once its link is put
// in: it comes by the link above, or by the border if there is none.
uint32_t corner_before(const Gaps& g, uint32_t node, uint32_t slot) {
  for (uint32_t above = slot + 1; above < g.slot_begin[node + 1]; above++)
    if (g.is_in(above)) return g.corner_of(g.slots[above].twin);
  return g.next[node];
}

void paint(Gaps& g, uint32_t start, uint32_t face) {
  uint32_t c = start;
  do {
    g.corner[c].face = face;
    c = g.corner[c].next;
  } while (c != start);
}

// Whether the rim that leaves from x is at most as long as the one from y.
bool shorter_rim(Gaps& g, uint32_t x, uint32_t y) {
  const uint32_t x0 = x, y0 = y;
  for (;;) {
    x = g.corner[x].next;
    y = g.corner[y].next;
    g.work -= 2;
    if (x == x0) return true;
    if (y == y0) return false;
  }
}

bool is_big(const Gaps& g, uint32_t corner) {
  uint32_t c = corner;
  for (uint32_t i = 0; i < kBigFace; i++)
    if ((c = g.corner[c].next) == corner) return false;
  return true;
}

void put_in(Gaps& g, Link& link) {
  const uint32_t s = link.slot[0], t = link.slot[1], a = link.node[0], b = link.node[1];
  const uint32_t before_a = corner_before(g, a, s), before_b = corner_before(g, b, t);
  const uint32_t at_a = g.corner[before_a].next, at_b = g.corner[before_b].next;
  const uint32_t leave_a = g.corner_of(s), leave_b = g.corner_of(t);
  const uint32_t fa = g.corner[at_a].face, fb = g.corner[at_b].face;
  const bool cuts = fa == fb;
  uint32_t face = fa;
  if (!cuts) {  // two faces become one
    const uint32_t pa = g.find(g.n[a].component), pb = g.find(g.n[b].component);
    // Without seams, two big faces that a link refused before could join are the ends of a tunnel: lids over
    // them would err by its width.
    const bool tunnel =
        !g.options.seams && link.kind == LinkKind::kRefused && is_big(g, at_a) && is_big(g, at_b);
    if (pa == pb && link.kind != LinkKind::kHandle && !tunnel) {
      link.kind = LinkKind::kRefused;
      return;
    }
    link.kind = pa == pb ? LinkKind::kMade : LinkKind::kIn;
    g.unite(pa, pb);
    const bool a_shorter = shorter_rim(g, at_a, at_b);
    face = a_shorter ? fb : fa;
    paint(g, a_shorter ? at_a : at_b, face);
  }
  g.corner[before_a].next = leave_a;
  g.corner[before_b].next = leave_b;
  g.corner[leave_a] = {at_b, face};
  g.corner[leave_b] = {at_a, face};
  if (cuts) {
    paint(g, shorter_rim(g, leave_a, leave_b) ? leave_a : leave_b, g.face_count++);
    link.kind = LinkKind::kIn;
  }
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
      Link& link = g.links[g.by_rank[i]];
      if (link.kind == kind) put_in(g, link);
    }
  if (GapTrace* t = g.options.trace; kTracing && t)
    for (uint32_t i = 0; i < t->link_count; i++) t->kind[i] = g.links[i].kind;
  return true;
}

}  // namespace relief
