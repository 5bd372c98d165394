// A golden stream with changes: the first byte of the input selects it, then each three bytes are a place
// (two bytes) and a new value. Reaches deeper than decode_fuzz in the same time.
#include "fuzz.h"
#include "golden.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const std::vector<relief::Golden> golden = relief::read_golden(RELIEF_SOURCE_DIR "/tests/golden");
  if (size == 0) return 0;
  std::vector<uint8_t> stream = golden[data[0] % golden.size()].stream;
  for (size_t i = 1; i + 2 < size; i += 3)
    stream[(data[i] | size_t(data[i + 1]) << 8) % stream.size()] = data[i + 2];
  relief::decode_and_check(stream.data(), stream.size());
  return 0;
}
