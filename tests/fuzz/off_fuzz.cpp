// Any bytes at all as an OFF file.
#include "import_fuzz.h"

namespace relief {

std::vector<std::string> seeds() {
  return {
      "OFF\n# a pyramid\n5 5 8\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0.5 0.5 1\n4 3 2 1 0\n3 0 1 4\n3 1 2 4\n3 2 3 "
      "4\n3 3 0 4\n",
      "COFF 3 1 3\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n0 1 0 0 0 255 255\n3 0 1 2 0.5 0.5 0.5\n",
      "STNOFF\n3 1 0\n0 0 0 0 0 1 0 0\n1 0 0 0 0 1 1 0\n0 1 0 0 0 1 0 1\n3 0 1 2\n"};
}

bool accepts(const uint8_t* data, size_t size) { return read_and_check(read_off, data, size); }

}  // namespace relief
