// Any bytes at all as a PCD file.
#include <cstring>

#include "import_fuzz.h"

namespace relief {
namespace {

// Two points with a normal, a colour, two values that nobody knows, and a position of doubles.
std::string binary() {
  std::string s =
      "VERSION 0.7\nFIELDS x y z normal_x normal_y normal_z rgba other\nSIZE 8 4 8 4 4 4 4 2\n"
      "TYPE F F F F F F U I\nCOUNT 1 1 1 1 1 1 1 2\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n"
      "POINTS 2\nDATA binary\n";
  auto put = [&s](auto value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    s.append(bytes, sizeof value);
  };
  for (int i = 0; i < 2; i++) {
    put(double(i)), put(0.5f), put(2.0);
    put(0.0f), put(0.0f), put(1.0f);
    put(0xff8040c0u), put(int16_t(3)), put(int16_t(-3));
  }
  return s;
}

}  // namespace

std::vector<std::string> seeds() {
  return {
      "# .PCD v.7\nVERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 3\nHEIGHT "
      "1\n"
      "POINTS 3\nDATA ascii\n0 0 0 4.2108e+06\n1 0 nan 4.2108e+06\n1 1 0 4.8e-39\n",
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 2 3", binary()};
}

bool accepts(const uint8_t* data, size_t size) { return read_and_check(read_pcd, data, size); }

}  // namespace relief
