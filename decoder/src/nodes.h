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
  uint32_t loop, place;  // number of the border loop, place along it
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

// The nodes of a loop follow one another, in the order of the border.
struct Nodes {
  uint32_t count, capacity, loop_count;
  Node* node;
  uint32_t* loop_length;

  Node& operator[](uint32_t i) const { return node[i]; }
  void allocate(Arena& a, uint32_t n) {
    count = 0, capacity = n, loop_count = 0;
    node = a.take<Node>(n);
    loop_length = a.take<uint32_t>(n);
  }
};

inline void difference(const Node& from, const Node& to, int64_t d[3]) {
  for (int k = 0; k < 3; k++) d[k] = to.position[k] - from.position[k];  // below 2^22
}

inline int64_t absolute(int64_t v) { return v < 0 ? -v : v; }

// The bits of a number; v > 0.
inline int bits_of(int64_t v) { return 64 - __builtin_clzll(uint64_t(v)); }

// v / 2^shift, rounded towards zero.
inline int64_t scale_down(int64_t v, int shift) {
  return (v + (v >> 63 & ((int64_t(1) << shift) - 1))) >> shift;
}

// Scales an integer vector (components below 2^50) to length kUnit, rounding towards zero. Only IEEE operations
// on doubles, one at a time: the same everywhere.
inline void unit_vector(const int64_t v[3], int16_t out[3]) {
  const double x = double(v[0]), y = double(v[1]), z = double(v[2]);
  const double square = x * x + y * y + z * z;
  const double scale = square > 0 ? kUnit / __builtin_sqrt(square) : 0;
  out[0] = int16_t(x * scale), out[1] = int16_t(y * scale), out[2] = int16_t(z * scale);
}

inline void cross(const int64_t a[3], const int64_t b[3], int64_t out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

}  // namespace relief
