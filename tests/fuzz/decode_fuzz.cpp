// Any bytes at all: an error, or a mesh that is what the header promises.
#include "fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  relief::decode_and_check(data, size);
  return 0;
}
