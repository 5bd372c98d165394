#include "triangulation.h"

#include <string.h>

namespace relief {
namespace {

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

// Of two triangles that are folded onto one another: as for one that is turned over.
int64_t cost_of_folding(const Gaps& g, const int16_t a[3], const int16_t b[3]) {
  const int64_t d = dot(a, b) / kUnit;
  return d < -kUnit * 7 / 8 ? 100 * int64_t(g.options.spacing) * -d : 0;
}

// What it costs to make an edge a second time: a vertex in its middle keeps the two apart.
int64_t cost_of_splitting(const Gaps& g) { return 8 * int64_t(g.options.spacing) * kUnit; }

// The normal beyond a side of a polygon: the patch's along its border, else unknown, zero.
void normal_beyond(const Gaps& g, uint32_t a, uint32_t b, int16_t out[3]) {
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

}  // namespace

bool has_edge(const Gaps& g, uint32_t a, uint32_t b) {
  if (g.n[a].next == b || g.n[a].prev == b || neighbouring_pixels(g.n[a], g.n[b])) return true;
  for (uint32_t i = g.slot_begin[a]; i < g.slot_begin[a + 1]; i++)
    if (g.slots[i].to == b && g.is_in(i)) return true;
  for (uint32_t i = g.diagonals[a]; i != kNone; i = g.diagonal[i].next)
    if (g.diagonal[i].to == b) return true;
  return false;
}

int64_t ear_cost(const Gaps& g, uint32_t a, uint32_t b, uint32_t c) {
  if (a == c || has_edge(g, a, c)) return kNoEar;
  int16_t unit[3];
  normal_of(g, a, b, c, unit);
  return weigh(g, a, b, c, unit, distance(g, a, c));
}

bool find_triangulation(const Gaps& g, const uint32_t* q, uint32_t m, Triangulation& t) {
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

uint32_t diagonal_of_quad(const Gaps& g, const uint32_t* q) {
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

}  // namespace relief
