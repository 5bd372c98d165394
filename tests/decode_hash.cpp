// decode_hash [--limits PATCHES PIXELS VERTICES] [--smooth] FILE...: decodes bare streams and prints for each
// a line: the SHA-256 of what it decodes to (see golden/README.md), or the number of the error.
// tests/reference/decode.py is its twin.
#include <cstdio>
#include <cstring>

#include "decoded.h"
#include "golden.h"

int main(int argc, char** argv) {
  using namespace relief;
  relief_limits limits = relief_default_limits;
  bool smooth = false;
  int i = 1;
  for (; i < argc && argv[i][0] == '-'; i++) {
    if (!std::strcmp(argv[i], "--smooth")) {
      smooth = true;
    } else if (!std::strcmp(argv[i], "--limits") && i + 3 < argc) {
      for (uint32_t* limit : {&limits.max_patches, &limits.max_pixels, &limits.max_vertices})
        *limit = uint32_t(std::strtoul(argv[++i], nullptr, 10));
    } else {
      std::fprintf(stderr, "usage: decode_hash [--limits PATCHES PIXELS VERTICES] [--smooth] FILE...\n");
      return 2;
    }
  }
  for (; i < argc; i++) {
    const std::vector<uint8_t> bytes = read_bytes(argv[i]);
    const Decoded d = decode_exactly(bytes.data(), bytes.size(), &limits, smooth);
    if (d.status == RELIEF_OK)
      std::puts(hash_of(d).c_str());
    else
      std::printf("%d\n", int(d.status));
  }
  return 0;
}
