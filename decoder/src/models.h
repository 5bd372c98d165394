// Adaptive binary models and the tables that are part of the format. Shared with the encoder.
#pragma once
#include <stddef.h>
#include <stdint.h>

// Where a call would send a coder's state through memory, bit by bit. Code for size does without, and shares
// what is in several places.
#if defined(__OPTIMIZE_SIZE__) || defined(RELIEF_SMALL)
#define RELIEF_INLINE inline
#define RELIEF_SHARED __attribute__((noinline))
#else
#define RELIEF_INLINE __attribute__((always_inline)) inline
#define RELIEF_SHARED RELIEF_INLINE
#endif

// What runs seldom in a file that is compiled for speed. GCC's `cold` is not for it: what is called from
// there and runs often would be compiled for size as well.
#ifdef __clang__
#define RELIEF_COLD __attribute__((minsize, noinline))
#else
#define RELIEF_COLD __attribute__((noinline))
#endif

namespace relief {

// An adaptive probability of a bit being 1: 22 bits of probability, 10 bits of count. The rate of adaptation
// falls with the count (1 / (count + 1.6)) until the limit, so that a fresh context learns fast and a used
// one is steady.
using Model = uint32_t;
constexpr Model kModelInit = 1u << 31;

constexpr Model model_of(uint32_t p16, uint32_t count) { return p16 << 16 | count; }

// Probability of a 1 in 16 bits, kept away from 0 and 1 so that no interval of the coder vanishes. Part of
// the format.
inline uint32_t model_p16(Model m) {
  uint32_t p = m >> 16;
  return p < 32 ? 32 : p > 65504 ? 65504 : p;
}

// 65536 / (count + 1.6), part of the format.
constexpr uint32_t kMostCount = 255;
struct ReciprocalTable {
  uint16_t of[kMostCount + 1];
  constexpr ReciprocalTable() : of() {
    for (uint32_t i = 0; i <= kMostCount; i++) of[i] = uint16_t(655360 / (10 * i + 16));
  }
};
inline constexpr ReciprocalTable kReciprocal;

template <uint32_t Limit>
inline void model_update(Model& m, int bit) {
  static_assert(Limit <= kMostCount);
  const uint32_t count = m & 1023;
  const int32_t p = int32_t(m >> 10), target = -bit & ((1 << 22) - 1);
  const int64_t step = int64_t(target - p) * kReciprocal.of[count];  // 16 bits of it are a fraction
  m += (uint32_t(step >> 6) & ~1023u) + (count < Limit);             // neither part spills into the other
}

// A coder for the length of a loop. Of the decoder it is a copy, written back at the end: stores through
// other pointers cannot change it, so that its state stays in registers.
template <class Coder, bool Encoding = Coder::kEncoding>
class CoderCopy {
 public:
  explicit CoderCopy(Coder& coder) : outer_(coder), inner_(coder) {}
  ~CoderCopy() { outer_ = inner_; }
  CoderCopy(const CoderCopy&) = delete;
  Coder& operator*() { return inner_; }

 private:
  Coder &outer_, inner_;
};

template <class Coder>
class CoderCopy<Coder, true> {
 public:
  explicit CoderCopy(Coder& coder) : outer_(coder) {}
  Coder& operator*() { return outer_; }

 private:
  Coder& outer_;
};

// Adaptation limits, part of the format.
constexpr uint32_t kCoefficientLimit = 255;
constexpr uint32_t kSingleLimit = 80;  // of bits of coefficients with one model, and of numbers
constexpr uint32_t kMaskLimit = 255;

// The coder's side of a bit: Coder is RangeDecoder (ignores `bit`, returns the decoded one) or RangeEncoder.
template <uint32_t Limit, class Coder>
RELIEF_INLINE int code_bit(Coder& coder, Model& m, int bit) {
  bit = coder.code(bit, model_p16(m));
  model_update<Limit>(m, bit);
  return bit;
}

// The same, where it is seldom.
template <uint32_t Limit, class Coder>
RELIEF_SHARED int code_seldom(Coder& coder, Model& m, int bit) {
  return code_bit<Limit>(coder, m, bit);
}

// Exponential-Golomb code of value >= 0 with adaptive models for the prefix and the top bit of the remainder.
// models: 40 of them. At most 20 prefix bits: value < 2^20.
constexpr int kGolombModels = 40;
template <class Coder>
[[gnu::noinline]] uint32_t code_golomb(Coder& coder, Model* models, uint32_t value) {
  int bits = 0;
  while (bits < 20 && (value + 1) >> (bits + 1)) bits++;
  int n = 0;
  while (n < 20 && code_seldom<kSingleLimit>(coder, models[n < 19 ? n : 19], n < bits)) n++;
  uint32_t out = 1;
  for (int i = n - 1; i >= 0; i--) {
    const int bit = (value + 1) >> i & 1;
    out = out * 2 + (i == n - 1 ? code_seldom<kSingleLimit>(coder, models[20 + (i < 19 ? i : 19)], bit)
                                : coder.code(bit, 32768));
  }
  return out - 1;
}

// The same where the coder's state is in registers: only a copy's address is taken.
template <class Coder>
RELIEF_INLINE uint32_t code_golomb_aside(Coder& coder, Model* models, uint32_t value) {
  if constexpr (Coder::kEncoding) {
    return code_golomb(coder, models, value);
  } else {
    Coder copy = coder;
    const uint32_t r = code_golomb(copy, models, value);
    coder = copy;
    return r;
  }
}

template <class Coder>
inline int32_t code_signed(Coder& coder, Model* models, int32_t value) {
  const uint32_t zigzag = code_golomb(coder, models, uint32_t(value) << 1 ^ uint32_t(value >> 31));
  return int32_t(zigzag >> 1) ^ -int32_t(zigzag & 1);
}

}  // namespace relief
