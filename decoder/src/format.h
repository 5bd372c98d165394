// What a stream consists of. Shared with the encoder. See docs/RELIEF_patch_compression for the text.
#pragma once
#include <stddef.h>
#include <stdint.h>

#include "relief/relief.h"

namespace relief {

// --- constants that are part of the format ---
constexpr int kLevels = 5;                     // wavelet levels (3.5)
constexpr int32_t kCoordinateLimit = 1 << 20;  // lattice coordinates are clamped to +- this
constexpr uint32_t kMaxSide = 1 << 15;         // pixels along a side of a patch
constexpr int kNormalBits = 8;                 // a plane's normal: octahedral map with 2^8 - 1 steps each way
constexpr int kFlagClosed = 1;                 // the surface has no border: every gap is closed
constexpr int kFlagBisk = 2;                   // coefficients are coded by bisk.h, else by coefficients.h
constexpr int kFlagColoured = 4;               // vertices have colours: colours.h
constexpr int kChannels = 3;                   // of colours
// Spacing of a patch's grid: 2^(-index / 4) of the stream's; step likewise 2^(index / 4).
constexpr int kMaxSpacingIndex = 63;
constexpr int kMaxStepIndex = 31;
constexpr uint32_t kLeastColourStep = 16, kMostColourStep = 1 << 16;

struct PatchHeader {
  uint32_t width, height;  // pixels; both at least 1
  int32_t x0, y0, z0;  // grid coordinates of pixel (0, 0) and the elevation's offset, in units of the spacing
  int32_t u, v;        // octahedral normal
  int32_t spacing_index;  // 0 .. kMaxSpacingIndex
  int32_t step_index;     // -kMaxStepIndex .. kMaxStepIndex
};

struct StreamHeader {
  uint32_t flags;
  float origin[3], scale;
  float spacing, step;  // lattice units; of index 0
  uint32_t patch_count, mask_pixels, boundary_nodes, vertex_count, triangle_count;
  uint32_t table_bytes;  // range-coded patch table and masks
  uint32_t coefficient_bytes, seam_bytes;
  uint32_t colour_step;              // of luma, in 1/256 levels of a byte
  uint32_t colour_bytes[kChannels];  // nothing of them without kFlagColoured
};

// A power 2^(i/4) without libm: exact powers of two times one of four constants.
inline double quarter_power(int i) {
  constexpr double kRoot[4] = {1.0, 1.189207115002721, 1.4142135623730951, 1.681792830507429};
  const int whole = i >> 2;
  double r = kRoot[i & 3];
  for (int k = 0; k < whole; k++) r *= 2;
  for (int k = 0; k > whole; k--) r *= 0.5;
  return r;
}

// The grid spacing of a patch in lattice units.
inline float spacing_of(float spacing, const PatchHeader& patch) {
  return float(double(spacing) * quarter_power(-patch.spacing_index));
}

// The orthonormal frame of a patch's plane (3.2) from its octahedral normal. IEEE square roots and divisions
// only.
struct Frame {
  double e1[3], e2[3], n[3];
};

inline Frame frame_of(int32_t u, int32_t v) {
  constexpr double kScale = 1.0 / ((1 << (kNormalBits - 1)) - 1);
  double x = u * kScale, y = v * kScale;
  double z = 1 - (x < 0 ? -x : x) - (y < 0 ? -y : y);
  if (z < 0) {  // the lower half of the octahedron is folded outwards
    const double ox = x, oy = y;
    x = (1 - (oy < 0 ? -oy : oy)) * (ox < 0 ? -1 : 1);
    y = (1 - (ox < 0 ? -ox : ox)) * (oy < 0 ? -1 : 1);
  }
  Frame f;
  const double l = __builtin_sqrt(x * x + y * y + z * z);
  f.n[0] = x / l, f.n[1] = y / l, f.n[2] = z / l;
  const double ax = f.n[0] < 0 ? -f.n[0] : f.n[0];
  // e1 = n x axis, normalised, with the axis that is well away from n
  const double a[3] = {ax < 0.7 ? 1.0 : 0.0, ax < 0.7 ? 0.0 : 1.0, 0.0};
  const double c[3] = {f.n[1] * a[2] - f.n[2] * a[1], f.n[2] * a[0] - f.n[0] * a[2],
                       f.n[0] * a[1] - f.n[1] * a[0]};
  const double k = __builtin_sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
  for (int i = 0; i < 3; i++) f.e1[i] = c[i] / k;
  f.e2[0] = f.n[1] * f.e1[2] - f.n[2] * f.e1[1];
  f.e2[1] = f.n[2] * f.e1[0] - f.n[0] * f.e1[2];
  f.e2[2] = f.n[0] * f.e1[1] - f.n[1] * f.e1[0];
  return f;
}

// a where the mask is all ones, b where it is zero: by bits, since compilers make no vectors of `?:` between
// values that took floating point operations, which might trap. Without vectors WebAssembly selects faster
// than it computes.
inline float pick(int32_t mask, float a, float b) {
#if defined(__wasm__) && !defined(__wasm_simd128__)
  return mask ? a : b;
#else
  int32_t x, y;
  __builtin_memcpy(&x, &a, 4);
  __builtin_memcpy(&y, &b, 4);
  x = (x & mask) | (y & ~mask);
  __builtin_memcpy(&a, &x, 4);
  return a;
#endif
}

// Rounds to the nearest lattice coordinate and clamps; NaN becomes the lower limit.
inline int32_t to_lattice(float v) {
  constexpr float kLimit = float(kCoordinateLimit);
  v = pick(-int32_t(v > -kLimit), v, -kLimit);
  v = pick(-int32_t(v < kLimit), v, kLimit);
  const float shifted = v + float(kCoordinateLimit * 2) + 0.5f;  // positive: truncation rounds down
  return int32_t(shifted) - kCoordinateLimit * 2;
}

// --- wavelet bands of a patch (3.5) ---
// Level l splits a plane of (w, h) into LL ((w+1)/2, (h+1)/2), HL, LH, HH; the LL of level kLevels-1 is coded
// as LL. Every band is kept in a plane with a margin of kMargin zeros on all sides.
constexpr uint32_t kMargin = 2;

struct Band {
  uint32_t width, height, stride;
  size_t offset;  // of the plane in the patch's planes
  size_t at(uint32_t x, uint32_t y) const { return offset + size_t(y + kMargin) * stride + x + kMargin; }
};

struct Pyramid {
  Band high[kLevels][3];  // HL, LH, HH of each level; 0 is the finest
  Band low[kLevels + 1];  // low[0]: the patch itself; low[l]: the LL of level l - 1
  size_t coded;           // elements of the planes that are coded, which come first: high and low[kLevels]
  size_t size;            // elements of all planes together
};

// Where a patch's planes begin among those of all patches: its masks, and its coefficients.
struct PlanesBegin {
  size_t mask, q;
  uint64_t pixels;  // of the masks before
};

inline Pyramid pyramid_of(uint32_t w, uint32_t h) {
  Pyramid p;
  size_t offset = 0;
  auto place = [&offset](Band& b, uint32_t width, uint32_t height) {
    b = {width, height, width + 2 * kMargin, offset};
    offset += size_t(b.stride) * (height + 2 * kMargin);
  };
  // each time rounded up
  auto halve = [](uint32_t v, int times) { return (v + (1u << times) - 1) >> times; };
  for (int l = 0; l < kLevels; l++)
    for (int type = 0; type < 3; type++) {
      const uint32_t lw = halve(w, l), lh = halve(h, l);
      place(p.high[l][type], (lw + type % 2) / 2, (lh + (type == 0)) / 2);
    }
  for (int l = kLevels; l >= 0; l--) {
    place(p.low[l], halve(w, l), halve(h, l));
    if (l == kLevels) p.coded = offset;
  }
  p.size = offset;
  return p;
}

// Steps of a band relative to the patch's step (HL and LH alike), part of the format.
inline float band_step(int level, int type) {
  constexpr float kStep[2][2] = {{1.35f, 1.8f}, {1.0f, 1.1f}};
  return level < 2 ? kStep[level][type == 2] : 1.0f;
}

// What 1 and -1 are worth, in steps: few of the values around are smaller, since those are 0. Part of the
// format.
constexpr float kReconstructedOne = 1.2f;

}  // namespace relief
