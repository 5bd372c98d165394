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

// Ends the program if a decode breaks a promise of relief.h; memory errors are the sanitizers' part.
inline bool decode_and_check(const uint8_t* data, size_t size) {
  const relief_limits limits = {1 << 10, 1 << 16, 1 << 16};
  const Decoded d = decode_exactly(data, size, &limits);
  const std::string fault = d.status == RELIEF_OK ? fault_of(d) : "";
  if (!fault.empty()) {
    std::fprintf(stderr, "%s\n", fault.c_str());
    std::abort();
  }
  return d.status == RELIEF_OK;
}

}  // namespace relief
