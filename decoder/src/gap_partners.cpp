// The search for partners over a gap: 4.2's projections onto the opposite border, with vertices for targets.
#include <string.h>

#include "gap_state.h"

namespace relief {
namespace {

constexpr int64_t kMaxVisits = 4096;  // cells and nodes a search looks at; only hostile streams need so many

// The buckets of the cells along x follow one another.
uint32_t bucket_of(const Gaps& g, int32_t x, int32_t y, int32_t z) {
  return (uint32_t(x) + (uint32_t(y) * 19349663u ^ uint32_t(z) * 83492791u)) & g.bucket_mask;
}

int32_t cell_of(const Gaps& g, int64_t coordinate) { return int32_t(coordinate >> g.cell_shift); }

// One node of a border in so many is searched for; its neighbours are found by following the border.
constexpr uint32_t kThinning = 3;

// Cells of six to twelve mean spacings, so that most searches look at a few of them.
void choose_cells(Gaps& g) {
  int64_t sum = 0;
  for (uint32_t v = 0; v < g.count; v++) sum += g.n[v].spacing;
  const int64_t size = 6 * (sum / g.count);
  g.cell_shift = 0;
  while (g.cell_shift < 20 && (int64_t(1) << g.cell_shift) < size) g.cell_shift++;
}

// Sorts one node in kThinning into hashed cells by counting.
void build_cells(Gaps& g) {
  uint32_t *const bucket = g.mark, *const begin = g.cell_begin + 1;  // at first: where the next node goes
  memset(g.cell_begin, 0, (size_t(g.bucket_mask) + 3) * sizeof(uint32_t));
  for (uint32_t v = 0; v < g.count; v++) {
    if (g.n[v].place % kThinning != 0) continue;
    const int32_t* p = g.n[v].position;
    bucket[v] = bucket_of(g, cell_of(g, p[0]), cell_of(g, p[1]), cell_of(g, p[2]));
    begin[bucket[v] + 1]++;
  }
  for (uint32_t i = 0; i <= g.bucket_mask; i++) begin[i + 1] += begin[i];
  for (uint32_t v = 0; v < g.count; v++) {
    if (g.n[v].place % kThinning != 0) continue;
    CellNode& c = g.cell_nodes[begin[bucket[v]]++];
    memcpy(c.position, g.n[v].position, sizeof c.position);
    c.node = v;
  }
}

// Steps between two nodes of a loop, the short way round.
uint32_t steps_apart(const Gaps& g, const Node& u, const Node& v) {
  const uint32_t d = u.place > v.place ? u.place - v.place : v.place - u.place;
  const uint32_t rest = g.n.loop_length[u.loop] - d;
  return d < rest ? d : rest;
}

// Gaps are up to about a pixel of either patch wide, more on slopes: 3.5 of the mean spacing is within reach.
int64_t reach_of(int64_t spacing_a, int64_t spacing_b) { return (spacing_a + spacing_b) * 7 / 4; }

constexpr int64_t kCannotFace = INT64_MAX;

// How far u is from v as its partner over a gap: the squared distance, four times as much where their normals
// are more than about 107 degrees apart (the two sides of a thin sheet's rim) or one lies above the other.
// kCannotFace if they are out of reach, near along one border, or one is not on the other's outer side: at a
// rim, where both borders end much at the same place, not by more than half a spacing.
int64_t facing_distance(const Gaps& g, const Node& v, const Node& u, int64_t d2) {
  const int64_t sum = int64_t(v.spacing) + u.spacing, reach = reach_of(v.spacing, u.spacing);
  if (d2 > reach * reach || neighbouring_pixels(u, v)) return kCannotFace;
  if (v.loop == u.loop && steps_apart(g, u, v) < 5) return kCannotFace;
  int64_t d[3];
  difference(v, u, d);
  const int64_t length = root(d2) * kUnit;
  const bool turned = int64_t(dot(v.normal, u.normal)) * 10 < -3 * int64_t(kUnit) * kUnit;
  const int64_t slack = turned ? sum * kUnit / 4 : length * 3 / 20;
  if (dot(d, v.outward) < -slack || dot(d, u.outward) > slack) return kCannotFace;
  if (turned) return 4 * d2;
  const int64_t hv = absolute(dot(d, v.normal)), hu = absolute(dot(d, u.normal));
  return hv * 10 > 9 * length && hu * 10 > 9 * length ? 9 * d2 : d2;
}

struct Search {
  int64_t best;  // squared distance
  uint32_t found;
  int64_t visits;
};

// Of equally near nodes the first in number is taken, so that the order of visits does not matter.
void consider(const Gaps& g, uint32_t v, uint32_t u, int64_t d2, Search& s) {
  if (d2 > s.best || (d2 == s.best && u >= s.found) || u == v) return;
  d2 = facing_distance(g, g.n[v], g.n[u], d2);
  if (d2 > s.best || (d2 == s.best && u >= s.found)) return;
  s.best = d2;
  s.found = u;
}

// Looks at the nodes of all cells that the cube of half side `radius` around v touches, by runs of buckets.
void search_cube(const Gaps& g, uint32_t v, int64_t radius, Search& s) {
  const int32_t* p = g.n[v].position;
  int32_t low[3], high[3];
  for (int k = 0; k < 3; k++) low[k] = cell_of(g, p[k] - radius), high[k] = cell_of(g, p[k] + radius);
  for (int32_t z = low[2]; z <= high[2]; z++)
    for (int32_t y = low[1]; y <= high[1]; y++) {
      uint32_t bucket = bucket_of(g, low[0], y, z);
      for (uint32_t left = uint32_t(high[0] - low[0] + 1), run; left > 0; left -= run, bucket = 0) {
        run = g.bucket_mask + 1 - bucket < left ? g.bucket_mask + 1 - bucket : left;
        const CellNode *c = g.cell_nodes + g.cell_begin[bucket], *const end = g.cell_nodes +
                                                                              g.cell_begin[bucket + run];
        s.visits += run + (end - c);
        if (s.visits > kMaxVisits) return;
        for (; c < end; c++) {
          const int64_t dx = c->position[0] - p[0], dy = c->position[1] - p[1], dz = c->position[2] - p[2];
          consider(g, v, c->node, dx * dx + dy * dy + dz * dz, s);
        }
      }
    }
}

// Follows the border of a node that faced the node before v to where it is nearest to v: mostly backwards.
// Borders of different grids take steps of different lengths, and those of one are not all nearer or all
// farther.
void follow_border(const Gaps& g, uint32_t v, uint32_t near, Search& s) {
  constexpr int kMostSteps = 16, kPatience = 2;
  constexpr uint32_t Node::*kWays[] = {&Node::prev, &Node::next};
  const Node& n = g.n[v];
  int64_t best = distance2(n, g.n[near]);
  uint32_t nearest = near;
  for (const auto way : kWays) {
    uint32_t u = near;
    for (int i = 0, vain = 0; i < kMostSteps && vain < kPatience; i++) {
      u = g.n[u].*way;
      const int64_t d2 = distance2(n, g.n[u]);
      vain++;
      if (d2 < best) best = d2, nearest = u, vain = 0;
    }
    if (nearest != near) break;
  }
  consider(g, v, nearest, best, s);
}

// near: the partner of the node before along the border, or kNone. Its border is followed; where that is more
// than one and a half mean spacings away another one may be nearer: one node in kThinning looks.
void find_partner(Gaps& g, uint32_t v, uint32_t near) {
  const int64_t most = reach_of(g.n[v].spacing, g.options.spacing) + 1, spacing = g.n[v].spacing;
  Search s = {most * most, kNone, 0};
  if (near != kNone) follow_border(g, v, near, s);
  const int64_t sum = s.found == kNone ? 0 : spacing + g.n[s.found].spacing;
  if (s.found == kNone || (16 * s.best > 9 * sum * sum && g.n[v].place % kThinning == 0)) {
    const uint32_t followed = s.found;
    for (int64_t radius = followed != kNone ? root(s.best) + 1 : 2 * spacing + 1;; radius *= 2) {
      if (radius > most) radius = most;
      if (followed == kNone) s.best = radius * radius;
      search_cube(g, v, radius, s);
      if (s.found != kNone || radius == most || s.visits > kMaxVisits) break;
    }
    if (s.found != followed) follow_border(g, v, s.found, s);
  }
  g.n[v].nearest = s.found;
  g.distance[v] = int32_t(root(s.best));
}

}  // namespace

void find_partners(Gaps& g) {
  choose_cells(g);
  build_cells(g);
  for (uint32_t v = 0; v < g.count; v++) find_partner(g, v, g.n[v].place == 0 ? kNone : g.n[v - 1].nearest);
}

}  // namespace relief
