// The search for partners over a gap: 4.2's projections onto the opposite border, with vertices for targets.
#include <string.h>

#include "gap_state.h"

namespace relief {
namespace {

constexpr int kMaxVisits =
    4096;  // cells and nodes that one search looks at; only hostile streams need so many

uint32_t hash_cell(const Gaps& g, int32_t x, int32_t y, int32_t z) {
  return (uint32_t(x) * 73856093u ^ uint32_t(y) * 19349663u ^ uint32_t(z) * 83492791u) & g.hash_mask;
}

int32_t cell_of(const Gaps& g, int64_t coordinate) { return int32_t(coordinate >> g.cell_shift); }

// One node of a border in so many is searched for; its neighbours are found by following the border.
constexpr uint32_t kThinning = 3;

// Cells of two to four mean spacings, so that most searches look at a few of them.
void choose_cells(Gaps& g) {
  int64_t sum = 0;
  for (uint32_t v = 0; v < g.count; v++) sum += g.n.spacing[v];
  const int64_t size = 2 * (sum / g.count);
  g.cell_shift = 0;
  while (g.cell_shift < 20 && (int64_t(1) << g.cell_shift) < size) g.cell_shift++;
}

// Sorts one node in kThinning into hashed cells by counting.
void build_cells(Gaps& g) {
  memset(g.cell_begin, 0, (size_t(g.hash_mask) + 2) * sizeof(uint32_t));
  uint32_t* const hash = g.mark;
  uint32_t sum = 0;
  for (uint32_t v = 0; v < g.count; v++) {
    if (g.place[v] % kThinning != 0) continue;
    const int32_t* p = g.n.position[v];
    hash[v] = hash_cell(g, cell_of(g, p[0]), cell_of(g, p[1]), cell_of(g, p[2]));
    g.cell_begin[hash[v] + 1]++;
    sum++;
  }
  for (uint32_t i = 0; i <= g.hash_mask; i++) g.cell_begin[i + 1] += g.cell_begin[i];
  for (uint32_t v = g.count; v-- > 0;) {  // fills each bucket from its end, which becomes its beginning
    if (g.place[v] % kThinning != 0) continue;
    CellNode& c = g.cell_nodes[--g.cell_begin[hash[v] + 1]];
    for (int k = 0; k < 3; k++) c.position[k] = g.n.position[v][k];
    c.node = v;
  }
  for (uint32_t i = 0; i <= g.hash_mask; i++) g.cell_begin[i] = g.cell_begin[i + 1];
  g.cell_begin[g.hash_mask + 1] = sum;
}

// Steps between two nodes of a loop, the short way round.
uint32_t steps_apart(const Gaps& g, uint32_t u, uint32_t v) {
  const uint32_t d = g.place[u] > g.place[v] ? g.place[u] - g.place[v] : g.place[v] - g.place[u];
  const uint32_t rest = g.loop_length[g.loop[u]] - d;
  return d < rest ? d : rest;
}

// Gaps are up to about a pixel of either patch wide, more on slopes: 3.5 of the mean spacing is within reach.
int64_t reach_of(int64_t spacing_a, int64_t spacing_b) { return (spacing_a + spacing_b) * 7 / 4; }

constexpr int64_t kCannotFace = INT64_MAX;

// How far u is from v as its partner over a gap: the squared distance, four times as much where their normals
// are more than about 107 degrees apart (the two sides of a thin sheet's rim) or one lies above the other.
// kCannotFace if they are out of reach, near along one border, or one is not on the other's outer side: at a
// rim, where both borders end much at the same place, not by more than half a spacing.
int64_t facing_distance(const Gaps& g, uint32_t v, uint32_t u, int64_t d2) {
  const int64_t sum = int64_t(g.n.spacing[v]) + g.n.spacing[u],
                reach = reach_of(g.n.spacing[v], g.n.spacing[u]);
  if (d2 > reach * reach || g.neighbouring_pixels(u, v)) return kCannotFace;
  if (g.loop[v] == g.loop[u] && steps_apart(g, u, v) < 5) return kCannotFace;
  int64_t d[3];
  g.difference(v, u, d);
  const int64_t length = root(d2) * kUnit;
  const bool turned = int64_t(dot(g.n.normal[v], g.n.normal[u])) * 10 < -3 * int64_t(kUnit) * kUnit;
  const int64_t slack = turned ? sum * kUnit / 4 : length * 3 / 20;
  if (dot(d, g.outward[v]) < -slack || dot(d, g.outward[u]) > slack) return kCannotFace;
  if (turned) return 4 * d2;
  const int64_t hv = absolute(dot(d, g.n.normal[v])), hu = absolute(dot(d, g.n.normal[u]));
  return hv * 10 > 9 * length && hu * 10 > 9 * length ? 9 * d2 : d2;
}

struct Search {
  int64_t best;  // squared distance
  uint32_t found;
  int visits;
};

// Of equally near nodes the first in number is taken, so that the order of visits does not matter.
void consider(const Gaps& g, uint32_t v, uint32_t u, int64_t d2, Search& s) {
  if (d2 > s.best || (d2 == s.best && u >= s.found) || u == v) return;
  d2 = facing_distance(g, v, u, d2);
  if (d2 > s.best || (d2 == s.best && u >= s.found)) return;
  s.best = d2;
  s.found = u;
}

// Looks at the nodes of all cells that the cube of half side `radius` around v touches.
void search_cube(const Gaps& g, uint32_t v, int64_t radius, Search& s) {
  const int32_t* p = g.n.position[v];
  int32_t low[3], high[3];
  for (int k = 0; k < 3; k++) low[k] = cell_of(g, p[k] - radius), high[k] = cell_of(g, p[k] + radius);
  for (int32_t z = low[2]; z <= high[2]; z++)
    for (int32_t y = low[1]; y <= high[1]; y++)
      for (int32_t x = low[0]; x <= high[0]; x++) {
        const uint32_t h = hash_cell(g, x, y, z);
        if (++s.visits > kMaxVisits) return;
        for (uint32_t i = g.cell_begin[h]; i < g.cell_begin[h + 1]; i++) {
          const CellNode& c = g.cell_nodes[i];
          const int64_t dx = c.position[0] - p[0], dy = c.position[1] - p[1], dz = c.position[2] - p[2];
          if (++s.visits > kMaxVisits) return;
          consider(g, v, c.node, dx * dx + dy * dy + dz * dz, s);
        }
      }
}

// Follows the border of a node that faced the node before v to where it is nearest to v. Borders of different
// grids take steps of different lengths.
void follow_border(const Gaps& g, uint32_t v, uint32_t near, Search& s) {
  constexpr int kMostSteps = 16, kPatience = 2;
  consider(g, v, near, g.distance2(v, near), s);
  const uint32_t* const ways[] = {g.n.prev, g.n.next};
  for (const uint32_t* along : ways) {
    uint32_t u = near;
    for (int i = 0, vain = 0; i < kMostSteps && vain < kPatience; i++) {
      u = along[u];
      const uint32_t found = s.found;
      consider(g, v, u, g.distance2(v, u), s);
      vain = s.found == found ? vain + 1 : 0;
    }
  }
}

// near: the partner of the node before along the border, or kNone. Within one and a half mean spacings its
// border is followed; further away another border may be nearer.
void find_partner(Gaps& g, uint32_t v, uint32_t near) {
  const int64_t most = reach_of(g.n.spacing[v], g.options.spacing) + 1, spacing = g.n.spacing[v];
  Search s = {most * most, kNone, 0};
  if (near != kNone) follow_border(g, v, near, s);
  const int64_t sum = s.found == kNone ? 0 : spacing + g.n.spacing[s.found];
  if (s.found == kNone || 16 * s.best > 9 * sum * sum) {
    const uint32_t followed = s.found;
    for (int64_t radius = followed != kNone ? root(s.best) + 1 : 2 * spacing + 1;; radius *= 2) {
      if (radius > most) radius = most;
      if (followed == kNone) s.best = radius * radius;
      search_cube(g, v, radius, s);
      if (s.found != kNone || radius == most || s.visits > kMaxVisits) break;
    }
    if (s.found != followed) follow_border(g, v, s.found, s);
  }
  g.nearest[v] = s.found;
  g.distance[v] = int32_t(root(s.best));
}

}  // namespace

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

// Tangent of the border x normal.
void find_outward(Gaps& g) {
  for (uint32_t v = 0; v < g.count; v++) {
    double t[3], c[3];
    g.difference(g.n.prev[v], g.n.next[v], t);
    const double m[3] = {double(g.n.normal[v][0]), double(g.n.normal[v][1]), double(g.n.normal[v][2])};
    cross(t, m, c);
    unit_vector(c, g.outward[v]);
  }
}

void find_partners(Gaps& g) {
  choose_cells(g);
  build_cells(g);
  for (uint32_t v = 0; v < g.count; v++) g.nearest[v] = kNone;
  for (uint32_t first = 0; first < g.count; first++) {
    if (g.place[first] != 0) continue;
    uint32_t near = kNone, v = first;  // along the loop
    do {
      find_partner(g, v, near);
      near = g.nearest[v];
      v = g.n.next[v];
    } while (v != first);
  }
}

}  // namespace relief
