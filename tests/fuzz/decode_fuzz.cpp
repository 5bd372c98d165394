// Any bytes at all: an error, or a mesh that is what the header promises.
#include "fuzz.h"

namespace relief {

std::vector<std::string> seeds() {
  std::vector<std::string> all;
  for (const Golden& g : golden()) all.emplace_back(g.stream.begin(), g.stream.end());
  return all;
}

bool accepts(const uint8_t* data, size_t size) { return decode_and_check(data, size); }

}  // namespace relief
