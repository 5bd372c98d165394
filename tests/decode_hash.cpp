// decode_hash [OPTION...] FILE...: decodes bare streams and prints for each a line: the SHA-256 of what it
// decodes to (see golden/README.md), or the number of the error. tests/reference/decode.py is its twin.
//   --limits PATCHES PIXELS VERTICES    --smooth    --points    --level L
//   --patches BITS                      patch i if the (i mod their number)-th bit is 1
//   --leaves scalar|vector|avx2         status 3: none such in this build or machine
#include <cstdio>
#include <cstring>

#include "decode.h"
#include "decoded.h"
#include "golden.h"

int main(int argc, char** argv) {
  using namespace relief;
  relief_limits limits = relief_default_limits;
  relief_options options = options_of(&limits);
  std::string bits;
  const Leaves* leaves = &best_leaves();
  int i = 1;
  for (; i < argc && argv[i][0] == '-'; i++) {
    if (!std::strcmp(argv[i], "--smooth")) {
      options.flags |= RELIEF_SMOOTH;
    } else if (!std::strcmp(argv[i], "--points")) {
      options.flags |= RELIEF_POINTS;
    } else if (!std::strcmp(argv[i], "--level") && i + 1 < argc) {
      options.level = uint32_t(std::atoi(argv[++i]));
    } else if (!std::strcmp(argv[i], "--patches") && i + 1 < argc) {
      bits = argv[++i];
    } else if (!std::strcmp(argv[i], "--limits") && i + 3 < argc) {
      for (uint32_t* limit : {&limits.max_patches, &limits.max_pixels, &limits.max_vertices})
        *limit = uint32_t(std::strtoul(argv[++i], nullptr, 10));
    } else if (!std::strcmp(argv[i], "--leaves") && i + 1 < argc) {
      const std::string level = argv[++i];
      leaves = leaves_of(level == "avx2"     ? Level::kAvx2
                         : level == "vector" ? Level::kVector
                                             : Level::kScalar);
      if (!leaves) return 3;
    } else {
      std::fprintf(stderr,
                   "usage: decode_hash [--limits PATCHES PIXELS VERTICES] [--smooth] [--points] [--level L] "
                   "[--patches BITS] [--leaves scalar|vector|avx2] FILE...\n");
      return 2;
    }
  }
  for (; i < argc; i++) {
    const std::vector<uint8_t> bytes = read_bytes(argv[i]);
    relief_info info;
    std::vector<uint8_t> patches;
    if (!bits.empty() && relief_inspect(bytes.data(), bytes.size(), &options, &info) == RELIEF_OK)
      for (uint32_t k = 0; k < info.patch_count; k++) patches.push_back(bits[k % bits.size()] == '1');
    options.patches = patches.empty() ? nullptr : patches.data();
    const Decoded d = decode_exactly_by(bytes.data(), bytes.size(), &options, [&](auto... arguments) {
      return decode_with(*leaves, arguments...);
    });
    if (d.status == RELIEF_OK)
      std::puts(hash_of(d).c_str());
    else
      std::printf("%d\n", int(d.status));
  }
  return 0;
}
