// Finds vertices of equal position.
#pragma once
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace relief {

// For each position the index of the first position that equals it (its own if there is none before); -0
// equals 0. Coordinates must be finite. Open addressing, linear time.
inline std::vector<uint32_t> weld_positions(const std::vector<std::array<float, 3>>& positions) {
  constexpr uint32_t kEmpty = 0xffffffffu;
  size_t mask = std::bit_ceil(positions.size() * 2 + 1) - 1;
  std::vector<uint32_t> table(mask + 1, kEmpty), first(positions.size());
  for (size_t i = 0; i < positions.size(); i++) {
    uint64_t h = 0;
    for (float c : positions[i]) {
      h = (h ^ std::bit_cast<uint32_t>(c + 0.0f)) * 0x9e3779b97f4a7c15ull;  // + 0 turns -0 into 0
      h ^= h >> 29;
    }
    size_t slot = h & mask;
    while (table[slot] != kEmpty && positions[table[slot]] != positions[i]) slot = (slot + 1) & mask;
    if (table[slot] == kEmpty) table[slot] = uint32_t(i);
    first[i] = table[slot];
  }
  return first;
}

}  // namespace relief
