// Tubes: handles of the surface that neither the patches nor the links between them have, because they are
// smaller than the grid. A tube joins two triangles of patches. Each gets a small triangle within, which is
// taken away, and its rim is joined to the other's. All edges but those of the two triangles are new:
// whichever two they are the mesh stays a manifold, and has one handle more (or one component less).
#include <string.h>

#include "gap_state.h"
#include "tube.h"

namespace relief {
namespace {

// One end of a tube: a triangle, and the rim within.
struct TubeEnd {
  uint32_t corner[3], rim[3];
  int64_t position[3][3];  // of the corners, then of the rim
  int64_t middle[3];
  int16_t normal[3];
};

int64_t distance2(const int64_t a[3], const int64_t b[3]) {
  int64_t sum = 0;
  for (int k = 0; k < 3; k++) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return sum;
}

TubeEnd read_end(const MeshWriter& m, const uint32_t* triangle) {
  TubeEnd e;
  int64_t u[3], v[3], n[3];
  memcpy(e.corner, triangle, sizeof e.corner);
  for (int k = 0; k < 3; k++) {
    for (int i = 0; i < 3; i++) e.position[i][k] = int64_t(m.positions[3 * size_t(e.corner[i]) + k]);
    e.middle[k] = (e.position[0][k] + e.position[1][k] + e.position[2][k]) / 3;
    u[k] = e.position[1][k] - e.position[0][k], v[k] = e.position[2][k] - e.position[0][k];
  }
  cross(u, v, n);
  unit_vector(n, e.normal);
  return e;
}

// The rim stands out of the triangle, by half as much as its corners are away from its middle but no more
// than 3/8 of the way to the other end, and leans towards that: a tube between neighbours is an arch that
// folds nothing over. to: the other end's middle; way: 1, or -1 for into the surface.
void add_rim(MeshWriter& m, TubeEnd& e, const int64_t to[3], int way) {
  int64_t least = INT64_MAX;
  for (int i = 0; i < 3; i++) {
    const int64_t d = distance2(e.position[i], e.middle);
    least = d < least ? d : least;
  }
  const int64_t length = root(distance2(e.middle, to)), half = root(least) / 2;
  const int64_t height = half < 3 * length / 8 ? half : 3 * length / 8;
  for (int i = 0; i < 3; i++) {
    int64_t ahead = 0;
    for (int k = 0; k < 3; k++) ahead += (e.position[i][k] - e.middle[k]) * (to[k] - e.middle[k]);
    const int64_t rise = height - (length ? ahead / (4 * length) : 0);
    e.rim[i] = m.vertex_count;
    for (int k = 0; k < 3; k++) {
      int64_t p = (e.position[i][k] + 3 * e.middle[k]) / 4 + way * (rise * e.normal[k] / kUnit);
      if (p > kCoordinateLimit) p = kCoordinateLimit;
      if (p < -kCoordinateLimit) p = -kCoordinateLimit;
      e.position[i][k] = p;
      m.positions[3 * size_t(m.vertex_count) + k] = float(p);
    }
    m.vertex_count++;
  }
}

// The corner of b's rim that the first one of a's goes to; the others follow in reverse.
int find_turn(const TubeEnd& a, const TubeEnd& b) {
  int64_t least = INT64_MAX;
  int best = 0;
  for (int turn = 0; turn < 3; turn++) {
    int64_t sum = 0;
    for (int i = 0; i < 3; i++) sum += distance2(a.position[i], b.position[(turn + 3 - i) % 3]);
    if (sum < least) least = sum, best = turn;
  }
  return best;
}

}  // namespace

bool add_tube(MeshWriter& m, uint32_t x, uint32_t y) {
  if (m.vertex_capacity - m.vertex_count < kTubeVertices ||
      m.triangle_capacity - m.triangle_count < kTubeTriangles)
    return false;
  TubeEnd a = read_end(m, m.indices + 3 * size_t(x)), b = read_end(m, m.indices + 3 * size_t(y));
  int64_t ahead = 0;  // of one another the ends lie
  for (int k = 0; k < 3; k++) ahead += (b.middle[k] - a.middle[k]) * (a.normal[k] - b.normal[k]);
  const int way = ahead < 0 ? -1 : 1;
  add_rim(m, a, b.middle, way);
  add_rim(m, b, a.middle, way);
  const int turn = find_turn(a, b);
  uint32_t* out = m.indices + 3 * size_t(m.triangle_count);
  m.triangle_count += kTubeTriangles;
  auto triangle = [&](uint32_t p, uint32_t q, uint32_t r, uint32_t* place) {
    uint32_t* const t = place ? place : out;
    t[0] = p, t[1] = q, t[2] = r;
    if (!place) out += 3;
  };
  for (int i = 0; i < 3; i++) {
    const int j = (i + 1) % 3, s = (turn + 3 - i) % 3, r = (s + 2) % 3;
    triangle(a.corner[i], a.corner[j], a.rim[j], i == 0 ? m.indices + 3 * size_t(x) : nullptr);
    triangle(b.corner[i], b.corner[j], b.rim[j], i == 0 ? m.indices + 3 * size_t(y) : nullptr);
    triangle(a.corner[i], a.rim[j], a.rim[i], nullptr);
    triangle(b.corner[i], b.rim[j], b.rim[i], nullptr);
    triangle(a.rim[i], a.rim[j], b.rim[r], nullptr);
    triangle(a.rim[i], b.rim[r], b.rim[s], nullptr);
  }
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
