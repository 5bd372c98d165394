// The vertices on the borders of patches, between which gaps are closed (4.2).
#pragma once
#include <stdint.h>

#include "arena.h"

namespace relief {

constexpr uint32_t kNone = 0xffffffffu;

// Vectors of directions have this length.
constexpr int32_t kUnit = 4096;

struct Nodes {
  uint32_t count, capacity;
  int32_t (*position)[3];  // lattice
  int16_t (*normal)[3];    // of the patch's surface there, length kUnit (or 0)
  uint32_t* vertex;        // in the mesh
  uint32_t *next, *prev;   // along the border, the patch on the left
  uint32_t* patch;
  uint32_t* component;  // connected piece of a patch
  int32_t* spacing;     // of the patch's grid, lattice units
  uint16_t (*pixel)[2];

  void allocate(Arena& a, uint32_t n) {
    count = 0, capacity = n;
    position = a.take<int32_t[3]>(n);
    normal = a.take<int16_t[3]>(n);
    vertex = a.take<uint32_t>(n);
    next = a.take<uint32_t>(n);
    prev = a.take<uint32_t>(n);
    patch = a.take<uint32_t>(n);
    component = a.take<uint32_t>(n);
    spacing = a.take<int32_t>(n);
    pixel = a.take<uint16_t[2]>(n);
  }
};

// Scales an integer vector (components below 2^46) to length kUnit, rounding towards zero. IEEE operations on
// exactly represented integers: the same everywhere.
inline void unit_vector(const double v[3], int16_t out[3]) {
  double x = v[0], y = v[1], z = v[2];
  auto large = [](double c) { return c > (1 << 24) || c < -(1 << 24); };
  auto quarter = [](double c) { return double(int64_t(c) / 4); };
  while (large(x) || large(y) || large(z)) x = quarter(x), y = quarter(y), z = quarter(z);
  const double l = __builtin_sqrt(x * x + y * y + z * z);
  if (l == 0) {
    out[0] = out[1] = out[2] = 0;
    return;
  }
  out[0] = int16_t(x * kUnit / l);
  out[1] = int16_t(y * kUnit / l);
  out[2] = int16_t(z * kUnit / l);
}

// Of vectors of integers; those of differences of lattice coordinates are exact also as doubles.
template <class Number>
inline void cross(const Number a[3], const Number b[3], Number out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

}  // namespace relief
