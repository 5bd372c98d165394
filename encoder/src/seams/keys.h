// Keys of what trials of seams have in common, by which nothing is looked at twice.
#pragma once
#include <array>
#include <bit>
#include <cstdint>

namespace relief {

inline uint64_t mixed(uint64_t h) {
  h = (h ^ h >> 32) * 0xd6e8feb86659fd93ull;
  return h ^ h >> 32;
}

inline uint64_t key_of(const std::array<float, 3>& position) {
  uint64_t h = 0;
  for (float c : position) h = mixed(h ^ std::bit_cast<uint32_t>(c));
  return h;
}

}  // namespace relief
