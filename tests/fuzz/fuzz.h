// What the fuzz targets check of every input.
#pragma once
#include <cstdio>
#include <cstdlib>

#include "decoded.h"

namespace relief {

// Ends the program if a decode breaks a promise of relief.h; memory errors are the sanitizers' part.
inline void decode_and_check(const uint8_t* data, size_t size) {
  const relief_limits limits = {1 << 10, 1 << 16, 1 << 16};
  const Decoded d = decode_exactly(data, size, &limits);
  const std::string fault = d.status == RELIEF_OK ? fault_of(d) : "";
  if (fault.empty()) return;
  std::fprintf(stderr, "%s\n", fault.c_str());
  std::abort();
}

}  // namespace relief
