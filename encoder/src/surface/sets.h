// Union-find with path halving (Tarjan and van Leeuwen 1984).
#pragma once
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace relief {

class Sets {
 public:
  explicit Sets(size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  uint32_t find(uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(uint32_t a, uint32_t b) {
    const uint32_t x = find(a), y = find(b);
    parent_[std::max(x, y)] = std::min(x, y);
  }
  uint64_t count() {
    uint64_t roots = 0;
    for (uint32_t i = 0; i < parent_.size(); i++) roots += parent_[i] == i;
    return roots;
  }

 private:
  std::vector<uint32_t> parent_;
};

}  // namespace relief
