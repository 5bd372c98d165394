// Tubes: handles of the surface that neither the patches nor the links between them have, because they are
// smaller than the grid. A tube joins two triangles of patches. Each gets a small triangle within, which is
// taken away, and its rim is joined to the other's. All edges but those of the two triangles are new:
// whichever two they are the mesh stays a manifold, and has one handle more (or one component less).
#include "tube.h"

#include "gap_state.h"

namespace relief {
namespace {

// One end of a tube: a triangle, and the rim within.
struct TubeEnd {
  int64_t corner[3][3], rim[3][3], middle[3];
  int16_t normal[3];
};

// Of the ways from o to a and to b.
[[gnu::noinline]] int64_t product(const int64_t a[3], const int64_t b[3], const int64_t o[3]) {
  int64_t sum = 0;
  for (int k = 0; k < 3; k++) sum += (a[k] - o[k]) * (b[k] - o[k]);
  return sum;
}
int64_t distance2(const int64_t a[3], const int64_t b[3]) { return product(a, a, b); }

[[gnu::noinline]] void read_end(const MeshWriter& m, const uint32_t* triangle, TubeEnd& e) {
  int64_t u[3], v[3], n[3];
  for (int k = 0; k < 3; k++) {
    int64_t sum = 0;
    for (int i = 0; i < 3; i++) sum += e.corner[i][k] = int64_t(m.positions[3 * size_t(triangle[i]) + k]);
    e.middle[k] = sum / 3;
    u[k] = e.corner[1][k] - e.corner[0][k], v[k] = e.corner[2][k] - e.corner[0][k];
  }
  cross(u, v, n);
  unit_vector(n, e.normal);
}

// The rim stands out of the triangle, by half as much as its corners are away from its middle but no more
// than 3/8 of the way to the other end, and leans towards that: a tube between neighbours is an arch that
// folds nothing over. to: the other end's middle; way: 1, or -1 for into the surface.
[[gnu::noinline]] void find_rim(TubeEnd& e, const int64_t to[3], int way) {
  const int64_t length = root(distance2(e.middle, to));
  int64_t height = 3 * length / 8;
  for (int i = 0; i < 3; i++) {
    const int64_t half = root(distance2(e.corner[i], e.middle)) / 2;
    if (half < height) height = half;
  }
  for (int i = 0; i < 3; i++) {
    const int64_t ahead = product(e.corner[i], to, e.middle);
    const int64_t rise = height - (length ? ahead / (4 * length) : 0);
    for (int k = 0; k < 3; k++) {
      const int64_t p = (e.corner[i][k] + 3 * e.middle[k]) / 4 + way * (rise * e.normal[k] / kUnit);
      e.rim[i][k] = clamp_coordinate(p);
    }
  }
}

// The corner of b's rim that the first one of a's goes to; the others follow in reverse.
uint32_t find_turn(const TubeEnd& a, const TubeEnd& b) {
  int64_t least = INT64_MAX;
  uint32_t best = 0;
  for (uint32_t turn = 0; turn < 3; turn++) {
    int64_t sum = 0;
    for (uint32_t i = 0; i < 3; i++) sum += distance2(a.rim[i], b.rim[(turn + 3 - i) % 3]);
    if (sum < least) least = sum, best = turn;
  }
  return best;
}

// Of vertices: the corners of x, those of y, the rims of x and y, each three in the order of x.
constexpr uint8_t kTube[2 + kTubeTriangles][3] = {
    {0, 1, 7}, {4, 3, 9},  {0, 7, 6}, {4, 9, 10},  {6, 7, 10}, {6, 10, 9},
    {1, 2, 8}, {5, 4, 10}, {1, 8, 7}, {5, 10, 11}, {7, 8, 11}, {7, 11, 10},
    {2, 0, 6}, {3, 5, 11}, {2, 6, 8}, {3, 11, 9},  {8, 6, 9},  {8, 9, 11}};

}  // namespace

bool add_tube(MeshWriter& m, uint32_t x, uint32_t y) {
  if (m.vertex_capacity - m.vertex_count < kTubeVertices ||
      m.triangle_capacity - m.triangle_count < kTubeTriangles)
    return false;
  uint32_t *const place_x = m.indices + 3 * size_t(x), *const place_y = m.indices + 3 * size_t(y);
  TubeEnd a, b;
  read_end(m, place_x, a);
  read_end(m, place_y, b);
  int64_t ahead = 0;  // of one another the ends lie
  for (int k = 0; k < 3; k++) ahead += (b.middle[k] - a.middle[k]) * (a.normal[k] - b.normal[k]);
  find_rim(a, b.middle, ahead < 0 ? -1 : 1);
  find_rim(b, a.middle, ahead < 0 ? -1 : 1);
  const uint32_t turn = find_turn(a, b), first = m.vertex_count;
  uint32_t vertex[12];
  for (uint32_t i = 0; i < 3; i++) {
    const uint32_t reverse = (turn + 3 - i) % 3;
    vertex[i] = place_x[i], vertex[3 + i] = place_y[reverse];
    vertex[6 + i] = first + i, vertex[9 + i] = first + 3 + i;
    for (uint32_t k = 0; k < 3; k++) {
      m.positions[3 * size_t(first + i) + k] = float(a.rim[i][k]);
      m.positions[3 * size_t(first + 3 + i) + k] = float(b.rim[reverse][k]);
    }
  }
  for (uint32_t t = 0; t < 2 + kTubeTriangles; t++) {
    uint32_t* const place = t == 0   ? place_x
                            : t == 1 ? place_y
                                     : m.indices + 3 * size_t(m.triangle_count + t - 2);
    for (int k = 0; k < 3; k++) place[k] = vertex[kTube[t][k]];
  }
  m.vertex_count += kTubeVertices, m.triangle_count += kTubeTriangles;
  return true;
}

relief_status add_tubes(Gaps& g, uint32_t patch_triangles) {
  MeshWriter& m = g.mesh;
  const uint32_t first = m.vertex_count;
  uint64_t left = most_tubes(g.count);
  auto is_joined = [&](uint32_t t) { return m.indices[3 * size_t(t) + 2] >= first; };
  for (g.seams.advance(); g.seams.next; g.seams.advance()) {
    const uint32_t x = g.seams.next - 1, ahead = g.seams.varint();
    if (x >= patch_triangles || ahead == 0 || ahead >= patch_triangles - x || left-- == 0)
      return RELIEF_ERROR_CORRUPT;
    if (is_joined(x) || is_joined(x + ahead)) return RELIEF_ERROR_CORRUPT;
    if (!add_tube(m, x, x + ahead)) return RELIEF_ERROR_OUTPUT;
  }
  return g.seams.good ? RELIEF_OK : RELIEF_ERROR_CORRUPT;
}

}  // namespace relief
