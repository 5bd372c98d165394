// XYZ: text, a point a line: x y z, then nothing, a normal, or a normal and a colour (red, green, blue of 0
// to 255). Six columns of which the last three are not a vector of at most unit length are positions and
// colours. Lines may be empty or comments that begin with '#'.
#include <cmath>

#include "surface/readers.h"
#include "surface/text_scanner.h"

namespace relief {
namespace {

// The numbers of a line, at most nine.
int parse_line(TextScanner& in, float (&value)[9]) {
  int count = 0;
  for (; in.more_on_line(); count++) {
    if (count == 9) in.fail("more than 9 numbers");
    value[count] = in.number();
  }
  return count;
}

std::array<uint8_t, 4> color_of(const float* v, const TextScanner& in) {
  std::array<uint8_t, 4> color = {0, 0, 0, 255};
  for (size_t k = 0; k < 3; k++) {
    if (!(v[k] >= 0 && v[k] <= 255)) in.fail("a colour beyond 0 to 255");
    color[k] = uint8_t(std::lround(v[k]));
  }
  return color;
}

bool is_direction(const float* n) { return n[0] * n[0] + n[1] * n[1] + n[2] * n[2] <= 1.01f; }

}  // namespace

TriangleMesh read_xyz(std::string_view bytes) {
  TextScanner in(bytes);
  TriangleMesh cloud;
  int columns = 0;
  bool normals = true;  // of six columns
  for (; in.skip_space_and_comments(), !in.at_end(); in.skip_line()) {
    float v[9] = {};
    const int count = parse_line(in, v);
    if (count != 3 && count != 6 && count != 9)
      in.fail("expected 3, 6 or 9 numbers, found " + std::to_string(count));
    if (columns > 0 && count != columns)
      in.fail("expected " + std::to_string(columns) + " numbers as before, found " + std::to_string(count));
    if (columns == 0) normals = count == 9 || is_direction(v + 3);
    columns = count;
    cloud.positions.push_back({v[0], v[1], v[2]});
    if (count > 3 && normals) cloud.normals.push_back({v[3], v[4], v[5]});
    if (count > 3 && (count == 9 || !normals)) cloud.colors.push_back(color_of(v + count - 3, in));
  }
  return cloud;
}

}  // namespace relief
