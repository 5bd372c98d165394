// Bump allocation in the caller's workspace. With a null base it only counts.
#pragma once
#include <stddef.h>
#include <stdint.h>

namespace relief {

struct Arena {
  explicit Arena(void* memory) : base(static_cast<uint8_t*>(memory)) {}

  uint8_t* base;
  uint64_t used = 0;

  template <class T>
  T* take(uint64_t count) {
    return static_cast<T*>(take_bytes(count * sizeof(T)));
  }

 private:
  [[gnu::noinline]] void* take_bytes(uint64_t bytes) {  // called from many places
    used = (used + 15) & ~uint64_t(15);
    void* p = base ? base + used : nullptr;
    used += bytes;
    return p;
  }
};

}  // namespace relief
