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

// Whether a stream that arrives in two pieces becomes the same as at once.
inline bool arrives_the_same(const uint8_t* data, size_t size, const relief_limits& limits, uint32_t seed) {
  const relief_options o = options_of(&limits);
  const Decoded whole = decode_exactly(data, size, &o);
  Arriving stream;
  const size_t least = std::min<size_t>(whole.info.masks_end, size) / 2;  // within the masks, too
  stream.take(data, least + seed % (size - least + 1), &o);
  return same(stream.decode(data, size, &o), whole);
}

// Ends the program if a decode breaks a promise of relief.h; memory errors are the sanitizers' part.
inline bool decode_and_check(const uint8_t* data, size_t size) {
  const relief_limits limits = {1 << 10, 1 << 16, 1 << 16, 0};
  const uint32_t seed = seed_of(data, size);
  const Decoded d = decode_randomly(data, size, limits, seed);
  std::string fault = d.status == RELIEF_OK ? fault_of(d) : "";
  if (d.status == RELIEF_OK && seed % 4 == 0 && !arrives_the_same(data, size, limits, seed / 4))
    fault = "in two pieces it is another mesh";
  if (!fault.empty()) {
    std::fprintf(stderr, "%s\n", fault.c_str());
    std::abort();
  }
  return d.status == RELIEF_OK;
}

}  // namespace relief
