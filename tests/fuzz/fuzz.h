// What the fuzz targets of the decoder check of every input.
#pragma once
#include <cstdio>
#include <cstdlib>

#include "decoded.h"
#include "golden.h"
#include "target.h"

namespace relief {

inline const std::vector<Golden>& golden() {
  static const std::vector<Golden> all = read_golden(RELIEF_SOURCE_DIR "/tests/golden");
  return all;
}

// The options are taken from the bytes as well.
inline uint32_t seed_of(const uint8_t* data, size_t size) {
  uint32_t hash = 2166136261u;  // FNV-1a
  for (size_t i = 0; i < size; i++) hash = (hash ^ data[i]) * 16777619u;
  return hash;
}

// Ends the program if a decode breaks a promise of relief.h; memory errors are the sanitizers' part.
inline bool decode_and_check(const uint8_t* data, size_t size) {
  const relief_limits limits = {1 << 10, 1 << 16, 1 << 16, 0};
  const Decoded d = decode_randomly(data, size, limits, seed_of(data, size));
  const std::string fault = d.status == RELIEF_OK ? fault_of(d) : "";
  if (!fault.empty()) {
    std::fprintf(stderr, "%s\n", fault.c_str());
    std::abort();
  }
  return d.status == RELIEF_OK;
}

}  // namespace relief
