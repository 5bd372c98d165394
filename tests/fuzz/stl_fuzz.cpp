// Any bytes at all as an STL file.
#include <cstring>

#include "import_fuzz.h"

namespace relief {

std::vector<std::string> seeds() {
  std::string binary(84 + 2 * 50, '\0');
  const float corner[6][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  binary[80] = 2;
  for (size_t i = 0; i < 6; i++) std::memcpy(&binary[84 + i / 3 * 50 + 12 + i % 3 * 12], corner[i], 12);
  return {
      "solid a b\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1e0 0\n"
      "  endloop\n endfacet\nendsolid a b\n",
      "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
      "0\nendloop\nendfacet\nendsolid\n"
      "solid two\nfacet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 "
      "-0\nendloop\nendfacet\nendsolid\n",
      binary};
}

bool accepts(const uint8_t* data, size_t size) { return read_and_check(read_stl, data, size); }

}  // namespace relief
