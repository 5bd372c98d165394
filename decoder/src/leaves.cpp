#include "leaves.h"

#include "diagonal.h"
#include "restore.h"
#include "runs.h"
#include "wavelet.h"

// A level without vectors costs space in a module that has them, and its absence nothing: only tests ask for
// it.
#if defined(__wasm__) && defined(__wasm_simd128__)
#define RELIEF_SCALAR_LEAVES 0
#else
#define RELIEF_SCALAR_LEAVES 1
#endif
#if defined(__SSE2__) || defined(__ARM_NEON) || defined(__wasm_simd128__)
#define RELIEF_VECTOR_LEAVES 1
#else
#define RELIEF_VECTOR_LEAVES 0
#endif
#if defined(__x86_64__) && defined(__GNUC__)
#define RELIEF_AVX2_LEAVES 1
#else
#define RELIEF_AVX2_LEAVES 0
#endif

// Loops whose vectors would take WebAssembly half a kilobyte each, for a third of a millisecond of thirty.
#ifdef __wasm__
#define RELIEF_SMALL_LOOP _Pragma("clang loop vectorize(disable)")
#define RELIEF_BOUNDS_LANES 3
#else
#define RELIEF_SMALL_LOOP
#define RELIEF_BOUNDS_LANES 12
#endif

namespace relief {
namespace {

#if RELIEF_VECTOR_LEAVES
namespace vector {
#include "leaves.inc"
}
#endif

#if RELIEF_SCALAR_LEAVES
namespace scalar {
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC optimize("no-tree-vectorize")
#endif
#include "leaves.inc"
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif
}  // namespace scalar
#endif

#if RELIEF_AVX2_LEAVES
namespace avx2 {
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2")
#endif
#include "leaves.inc"
#ifdef __clang__
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
}  // namespace avx2
#endif

}  // namespace

const Leaves* leaves_of(Level level) {
  switch (level) {
#if RELIEF_SCALAR_LEAVES
    case Level::kScalar:
      return &scalar::kLeaves;
#endif
#if RELIEF_VECTOR_LEAVES
    case Level::kVector:
      return &vector::kLeaves;
#endif
#if RELIEF_AVX2_LEAVES
    case Level::kAvx2:
      return __builtin_cpu_supports("avx2") ? &avx2::kLeaves : nullptr;
#endif
    default:
      return nullptr;
  }
}

const Leaves& best_leaves() {
#if RELIEF_AVX2_LEAVES
  if (__builtin_cpu_supports("avx2")) return avx2::kLeaves;
#endif
#if RELIEF_VECTOR_LEAVES
  return vector::kLeaves;
#else
  return scalar::kLeaves;
#endif
}

}  // namespace relief
