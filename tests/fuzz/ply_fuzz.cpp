// Any bytes at all as a PLY file.
#include <cstring>

#include "import_fuzz.h"

namespace relief {
namespace {

template <class T>
void put(std::string& out, T value, bool big) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  for (size_t i = 0; i < sizeof value; i++) out += bytes[big ? sizeof value - 1 - i : i];
}

// A tetrahedron with normals, and an element that nobody knows before it.
std::string binary(bool big) {
  std::string s = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                  "_endian 1.0\nelement camera 1\nproperty double f\nproperty list uchar short tag\n"
                  "element vertex 4\nproperty float x\nproperty double y\nproperty short z\n"
                  "property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\n"
                  "element face 4\nproperty list uchar int vertex_indices\nproperty char flag\nend_header\n";
  put(s, 1.5, big), put(s, uint8_t(2), big), put(s, int16_t(7), big), put(s, int16_t(-7), big);
  const int at[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
            of[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  for (const auto& p : at) {
    put(s, float(p[0]), big), put(s, double(p[1]), big), put(s, int16_t(p[2]), big);
    for (int k = 0; k < 3; k++) put(s, k == 2 ? 1.0f : 0.0f, big);
    put(s, uint8_t(200), big);
  }
  for (const auto& f : of) {
    put(s, uint8_t(3), big);
    for (int i : f) put(s, int32_t(i), big);
    put(s, int8_t(-1), big);
  }
  return s;
}

}  // namespace

std::vector<std::string> seeds() {
  return {
      "ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\nproperty float x\nproperty float "
      "y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n1 1 0.25\n0 1 0\n4 0 "
      "1 2 3\n",
      "ply\nformat ascii 1.0\nelement face 2\nproperty list int uint vertex_indices\nproperty list char "
      "float weight\n"
      "element vertex 3\nproperty double z\nproperty double y\nproperty double x\nend_header\n"
      "3 0 1 2 1 0.5\n2 0 1 0\n0 0 0\n1 0 0\n0 1 0\n",
      binary(false), binary(true)};
}

bool accepts(const uint8_t* data, size_t size) { return read_and_check(read_ply, data, size); }

}  // namespace relief
