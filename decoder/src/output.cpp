#include "output.h"

#include <string.h>

namespace relief {
namespace {

constexpr uint32_t kMost16 = 65535;  // vertices with 16-bit indices; glTF has no index 65535

struct Bounds {
  float low[3], high[3];  // lattice coordinates
};

// Writes element by element, `stride` bytes apart. fill: makes the one of a number.
template <class T, size_t N, class Fill>
void write(void* out, size_t stride, uint32_t count, Fill fill) {
  uint8_t* to = static_cast<uint8_t*>(out);
  for (uint32_t i = 0; i < count; i++, to += stride) {
    T element[N] = {};
    fill(i, element);
    memcpy(to, element, sizeof element);
  }
}

void copy_vectors(const float* from, void* out, size_t stride, uint32_t count) {
  write<float, 3>(out, stride, count, [=](uint32_t i, float* v) { memcpy(v, from + 3 * size_t(i), 12); });
}

// Coordinates over +-32767 by the largest side of the box, about its middle: integers, rounded to nearest.
void quantise_positions(const relief_options& o, const StreamHeader& h, const MeshWriter& mesh,
                        const Bounds& b, relief_mesh& out) {
  int64_t sum[3], side = 1;
  for (int i = 0; i < 3; i++) {
    sum[i] = int64_t(b.low[i]) + int64_t(b.high[i]);
    const int64_t s = int64_t(b.high[i]) - int64_t(b.low[i]);
    if (s > side) side = s;
    out.offset[i] = float(double(h.origin[i]) + double(h.scale) * (double(sum[i]) / 2));
  }
  out.scale = float(double(h.scale) * (double(side) / 2));
  write<int16_t, 4>(out.positions, o.position_stride, mesh.vertex_count, [&](uint32_t v, int16_t* q) {
    for (int i = 0; i < 3; i++) {
      const int64_t n = 2 * 32767 * (2 * int64_t(mesh.positions[3 * size_t(v) + size_t(i)]) - sum[i]);
      q[i] = int16_t((n < 0 ? n - side : n + side) / (2 * side));
    }
  });
}

void quantise_normals(const relief_options& o, const float* normals, uint32_t count, void* out) {
  write<int8_t, 4>(out, o.normal_stride, count, [=](uint32_t v, int8_t* q) {
    for (int i = 0; i < 3; i++) {
      const double n = 127 * double(normals[3 * size_t(v) + size_t(i)]);
      q[i] = int8_t(n < 0 ? n - 0.5 : n + 0.5);
    }
  });
}

}  // namespace

relief_status write_output(const relief_options& o, const StreamHeader& h, const MeshWriter& mesh,
                           const float* normals, relief_mesh& out, const Leaves& leaves) {
  const uint32_t vertices = mesh.vertex_count;
  if (!wide_indices(o) && vertices > kMost16) return RELIEF_ERROR_OUTPUT;
  Bounds b = {};
  if (vertices > 0) leaves.bounds(mesh.positions, vertices, b.low, b.high);
  if (!kPlain && o.flags & RELIEF_QUANTISED)
    quantise_positions(o, h, mesh, b, out);
  else
    leaves.place(h.origin, h.scale, mesh.positions, vertices);
  if (vertices > 0) {
    leaves.place(h.origin, h.scale, b.low, 1);
    leaves.place(h.origin, h.scale, b.high, 1);
  }
  memcpy(out.min, b.low, sizeof b.low);
  memcpy(out.max, b.high, sizeof b.high);
  if (!kPlain) {
    const bool quantised = o.flags & RELIEF_QUANTISED;
    if (!quantised && !float_positions(o))
      copy_vectors(mesh.positions, out.positions, o.position_stride, vertices);
    if (normals && quantised)
      quantise_normals(o, normals, vertices, out.normals);
    else if (normals && !float_normals(o))
      copy_vectors(normals, out.normals, o.normal_stride, vertices);
    if (!wide_indices(o) && out.indices)
      write<uint16_t, 3>(out.indices, sizeof(uint16_t[3]), mesh.triangle_count, [&](uint32_t t, uint16_t* i) {
        for (size_t k = 0; k < 3; k++) i[k] = uint16_t(mesh.indices[3 * size_t(t) + k]);
      });
  }
  out.vertex_count = vertices;
  out.triangle_count = mesh.triangle_count;
  return RELIEF_OK;
}

}  // namespace relief
