// Any bytes at all as an XYZ file.
#include "import_fuzz.h"

namespace relief {

std::vector<std::string> seeds() {
  return {"# three points\n0 0 0\n1 0 0\n\n0 1 +2e-1\n", "0 0 0 0 0 1\r\n1 0 0 0 1 0\r\n",
          "0 0 0 255 0 0\n1 0 0 0 255 0\n", "0 0 0 0 0 1 255 128 0\n1 0 0 0 0 -1 0 0 0"};
}

bool accepts(const uint8_t* data, size_t size) { return read_and_check(read_xyz, data, size); }

}  // namespace relief
