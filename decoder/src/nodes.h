// The vertices on the borders of patches, between which gaps are closed (4.2).
#pragma once
#include <stdint.h>

#include "arena.h"

namespace relief {

constexpr uint32_t kNone = 0xffffffffu;

// Vectors of directions have this length.
constexpr int32_t kUnit = 4096;

// Closing gaps goes from node to node: all that is known of one lies in 64 bytes.
struct Node {
  int32_t position[3];   // lattice
  int16_t normal[3];     // of the patch's surface there, length kUnit (or 0)
  int16_t outward[3];    // in that surface, out of the patch, likewise
  uint32_t next, prev;   // along the border, the patch on the left
  uint32_t loop, place;  // number of the border, place along it
  uint32_t patch;
  uint16_t pixel[2];
  int32_t spacing;     // of the patch's grid, lattice units
  uint32_t component;  // connected piece of a patch
  uint32_t vertex;     // in the mesh
  uint32_t nearest;    // the node that faces it over a gap, or kNone
};

// Whether two nodes are pixels next to one another, if only at a corner: no link joins them.
inline bool neighbouring_pixels(const Node& u, const Node& v) {
  if (u.patch != v.patch) return false;
  const int dx = int(u.pixel[0]) - v.pixel[0], dy = int(u.pixel[1]) - v.pixel[1];
  return dx >= -1 && dx <= 1 && dy >= -1 && dy <= 1;
}

struct Nodes {
  uint32_t count, capacity;
  Node* node;

  Node& operator[](uint32_t i) const { return node[i]; }
  void allocate(Arena& a, uint32_t n) {
    count = 0, capacity = n;
    node = a.take<Node>(n);
  }
};

inline int64_t absolute(int64_t v) { return v < 0 ? -v : v; }

// The bits of a number; v > 0.
inline int bits_of(int64_t v) { return 64 - __builtin_clzll(uint64_t(v)); }

// v / 2^shift, rounded towards zero.
inline int64_t scale_down(int64_t v, int shift) {
  return (v + (v >> 63 & ((int64_t(1) << shift) - 1))) >> shift;
}

// Scales an integer vector (components below 2^50) to length kUnit, rounding towards zero. The vector is
// divided by the least power of 4 with which no component is above 2^24: the square of its length is exact,
// and IEEE operations on exactly represented integers are the same everywhere.
inline void unit_vector(const int64_t v[3], int16_t out[3]) {
  constexpr int kBits = 24;
  int64_t most = absolute(v[0]);
  for (int k = 1; k < 3; k++)
    if (absolute(v[k]) > most) most = absolute(v[k]);
  if (most == 0) {
    out[0] = out[1] = out[2] = 0;
    return;
  }
  const int bits = bits_of(most);
  int shift = bits > kBits ? (bits - kBits + 1) & ~1 : 0;
  if (shift && most >> (shift - 2) == 1 << kBits) [[unlikely]]
    shift -= 2;
  int64_t c[3], square = 0;
  for (int k = 0; k < 3; k++) {
    c[k] = scale_down(v[k], shift);
    square += c[k] * c[k];
  }
  const double length = __builtin_sqrt(double(square));
  for (int k = 0; k < 3; k++) out[k] = int16_t(double(c[k] * kUnit) / length);
}

inline void cross(const int64_t a[3], const int64_t b[3], int64_t out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

}  // namespace relief
