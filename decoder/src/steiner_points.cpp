// Steiner points: vertices that are no pixels', where the surface bulges between patches. Each splits an edge
// between two triangles of gaps, and stands over its middle.
#include "gap_state.h"

namespace relief {
namespace {

// A triangle and one of its edges, seen from within: from a to b, with the corner opposite.
struct Side {
  uint32_t* corners;
  uint32_t edge;
  uint32_t a() const { return corners[edge]; }
  uint32_t b() const { return corners[(edge + 1) % 3]; }
  uint32_t opposite() const { return corners[(edge + 2) % 3]; }
};

bool find_other_side(const Side& side, uint32_t* end, Side& other) {
  for (other.corners = side.corners + 3; other.corners != end; other.corners += 3)
    for (other.edge = 0; other.edge < 3; other.edge++)
      if (other.a() == side.b() && other.b() == side.a()) return true;
  return false;
}

// So many parts of the edge's length over its middle, along the normal of both triangles.
void place_point(const MeshWriter& m, const Side& s, const Side& other, int64_t height) {
  int64_t along[3], across[3], sum[3], normal[3], square = 0;
  for (int k = 0; k < 3; k++) {
    auto at = [&](uint32_t v) { return int64_t(m.positions[3 * size_t(v) + size_t(k)]); };
    along[k] = at(s.b()) - at(s.a()), across[k] = at(s.opposite()) - at(other.opposite());
    sum[k] = at(s.a()) + at(s.b());
    square += along[k] * along[k];
  }
  cross(along, across, normal);
  int16_t unit[3];
  unit_vector(normal, unit);
  const int64_t rise = height * root(square);
  for (int k = 0; k < 3; k++) {
    const int64_t p = sum[k] / 2 + rise * unit[k] / (kSteinerParts * kUnit);
    m.positions[3 * size_t(m.vertex_count) + size_t(k)] = float(clamp_coordinate(p));
  }
}

// The half at b of a triangle becomes a triangle of its own.
void split(MeshWriter& m, const Side& s, uint32_t point) {
  uint32_t* const half = m.indices + 3 * size_t(m.triangle_count++);
  half[0] = point, half[1] = s.b(), half[2] = s.opposite();
  s.corners[(s.edge + 1) % 3] = point;
}

}  // namespace

relief_status add_steiner_points(Gaps& g, uint32_t first, uint32_t end) {
  MeshWriter& m = g.mesh;
  uint64_t left = most_steiner_points(g.count);
  for (g.seams.advance(); g.seams.next; g.seams.advance()) {
    const uint32_t t = g.seams.next - 1, code = g.seams.varint(), zigzag = code / 3;
    if (t >= end - first || code >= 3 * 2 * kSteinerHeights || left-- == 0) return RELIEF_ERROR_CORRUPT;
    const uint32_t ahead = end - first - t <= kSteinerWindow ? end - first - t : kSteinerWindow + 1;
    const Side side = {m.indices + 3 * size_t(first + t), code % 3};
    Side other;
    if (!find_other_side(side, side.corners + 3 * size_t(ahead), other)) continue;
    if (m.vertex_count == m.vertex_capacity || m.triangle_capacity - m.triangle_count < 2)
      return RELIEF_ERROR_OUTPUT;
    place_point(m, side, other, int64_t(zigzag >> 1) ^ -int64_t(zigzag & 1));
    split(m, side, m.vertex_count);
    split(m, other, m.vertex_count++);
  }
  return g.seams.good ? RELIEF_OK : RELIEF_ERROR_CORRUPT;
}

}  // namespace relief
