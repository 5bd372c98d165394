// Bump allocation in the caller's workspace. With a null base it only counts.
#pragma once
#include <stddef.h>
#include <stdint.h>

namespace relief {

struct Arena {
  uint8_t* base;
  uint64_t used = 0;

  template <class T>
  T* take(uint64_t count) {
    used = (used + 15) & ~uint64_t(15);
    T* p = base ? reinterpret_cast<T*>(base + used) : nullptr;
    used += count * sizeof(T);
    return p;
  }
};

}  // namespace relief
