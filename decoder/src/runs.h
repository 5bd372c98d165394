// Runs of equal bytes in a row, for masks.
#pragma once
#include <stdint.h>

namespace relief {

constexpr uint64_t kEachByte = 0x0101010101010101u;

inline uint64_t load8(const uint8_t* p) {
  uint64_t v;
  __builtin_memcpy(&v, p, 8);
  return v;
}

constexpr bool kLittleEndian = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;

// Pixels p[0] .. p[7], 0 or 1, as bits, the first in bit 0.
inline uint32_t pack_pixels(const uint8_t* p) {
  uint64_t v = load8(p);
  if (!kLittleEndian) v = __builtin_bswap64(v);
  return uint32_t(v * 0x0102040810204080u >> 56);
}

// Which byte of a word, in the order of memory, is the first that is not zero; 8 if there is none.
inline int first_byte(uint64_t word) {
  if (!word) return 8;
  return (kLittleEndian ? __builtin_ctzll(word) : __builtin_clzll(word)) / 8;
}

// In which byte the lowest bit of a word is that is set.
inline uint32_t byte_of_lowest_bit(uint64_t word) {
  const uint32_t byte = uint32_t(__builtin_ctzll(word)) / 8;
  return kLittleEndian ? byte : 7 - byte;
}

// A word whose first bytes, in the order of memory, are all ones; count: 1 .. 7 of them.
inline uint64_t first_bytes(uint32_t count) {
  return kLittleEndian ? (uint64_t(1) << 8 * count) - 1 : ~(~uint64_t(0) >> 8 * count);
}

// The first place from x on, and before end, whose byte is not `value`, or else end.
[[gnu::noinline]] inline int run_end(const uint8_t* row, int x, int end, uint8_t value) {
  for (; x + 8 <= end; x += 8)
    if (const int same = first_byte(load8(row + x) ^ value * kEachByte); same < 8) return x + same;
  while (x < end && row[x] == value) x++;
  return x;
}

}  // namespace relief
