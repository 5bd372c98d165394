// Any bytes at all as a Wavefront OBJ.
#include "import_fuzz.h"

namespace relief {

std::vector<std::string> seeds() {
  return {
      "# a square\no one\nv 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\nf 1 2 3 4\n",
      "v 0 0 0\nv 1 0 0 1.0\nv 0 1 0\nvn 0 0 1\nvt 0.5 0.5\nf 1//1 2//1 3/1/1\n",
      "g a\r\nv 1e-3 -2.5 +3\r\nv 4 5 6\r\nv 7 8 \\\n 9\r\nusemtl x\r\nf -3/-1 -2 -1\r\ns off\r\nl 1 2\r\n"};
}

bool accepts(const uint8_t* data, size_t size) { return read_and_check(read_obj, data, size); }

}  // namespace relief
