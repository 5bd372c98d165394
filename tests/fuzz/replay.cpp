// Runs a fuzz target on the files given, for compilers without libFuzzer: to replay what it found, or a
// corpus.
#include <cstdio>

#include "golden.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

int main(int argc, char** argv) {
  for (int i = 1; i < argc; i++) {
    try {
      const std::vector<uint8_t> bytes = relief::read_bytes(argv[i]);
      LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
    } catch (const std::exception& e) {
      std::fprintf(stderr, "%s\n", e.what());
      return 1;
    }
  }
  return 0;
}
