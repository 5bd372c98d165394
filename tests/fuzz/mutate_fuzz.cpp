// A golden stream with changes: the first byte of the input selects it, then each three bytes are a place
// (two bytes) and a new value. Reaches deeper than decode_fuzz in the same time.
#include "fuzz.h"

namespace relief {

std::vector<std::string> seeds() {
  std::vector<std::string> all;
  for (size_t i = 0; i < golden().size(); i++) all.push_back(std::string(1, char(i)));
  return all;
}

bool accepts(const uint8_t* data, size_t size) {
  if (size == 0) return false;
  std::vector<uint8_t> stream = golden()[data[0] % golden().size()].stream;
  for (size_t i = 1; i + 2 < size; i += 3)
    stream[(data[i] | size_t(data[i + 1]) << 8) % stream.size()] = data[i + 2];
  return decode_and_check(stream.data(), stream.size());
}

}  // namespace relief
