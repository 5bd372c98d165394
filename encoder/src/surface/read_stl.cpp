// STL, binary and ascii. A file of loose triangles: corners of equal position become one vertex.
#include <cmath>
#include <cstring>
#include <limits>

#include "surface/readers.h"
#include "surface/text_scanner.h"
#include "surface/weld.h"

namespace relief {
namespace {

constexpr size_t kHeaderBytes = 84,
                 kFacetBytes = 50;  // 80 bytes of comment and a count; 12 floats and 2 bytes

std::vector<std::array<float, 3>> read_binary_corners(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes) throw InputError("the file ends within the STL header");
  uint32_t count;
  std::memcpy(&count, bytes.data() + 80, 4);
  if (count > (bytes.size() - kHeaderBytes) / kFacetBytes)
    throw InputError("the file is too short for its " + std::to_string(count) + " triangles");
  std::vector<std::array<float, 3>> corners(size_t(count) * 3);
  for (size_t i = 0; i < count; i++)
    std::memcpy(corners[3 * i].data(), bytes.data() + kHeaderBytes + i * kFacetBytes + 12, 36);
  return corners;
}

void expect(TextScanner& in, std::string_view word) {
  if (std::string_view found = in.word(); found != word)
    in.fail("expected '" + std::string(word) + "'" + (found.empty() ? ", but the file ends" : ""));
}

void read_facet(TextScanner& in, std::vector<std::array<float, 3>>& corners) {
  in.line();  // the normal follows from the corners
  expect(in, "outer");
  expect(in, "loop");
  for (int k = 0; k < 3; k++) {
    expect(in, "vertex");
    auto& p = corners.emplace_back();
    for (float& c : p) c = in.number();
  }
  expect(in, "endloop");
  expect(in, "endfacet");
}

std::vector<std::array<float, 3>> read_ascii_corners(std::string_view bytes) {
  TextScanner in(bytes);
  std::vector<std::array<float, 3>> corners;
  in.line();  // "solid" and a name, which may be any text
  while (true) {
    std::string_view word = in.word();
    if (word == "facet") {
      read_facet(in, corners);
    } else if (word == "endsolid") {
      in.line();
      if (in.word().empty()) return corners;
      in.line();  // another solid
    } else if (word.empty()) {
      in.fail("the file ends before 'endsolid'");
    } else {
      in.fail("expected 'facet' or 'endsolid'");
    }
  }
}

// Some binary files begin with "solid" too, so the size decides first.
bool is_binary(std::string_view bytes) {
  if (bytes.size() >= kHeaderBytes) {
    uint32_t count;
    std::memcpy(&count, bytes.data() + 80, 4);
    if (bytes.size() == kHeaderBytes + uint64_t(count) * kFacetBytes) return true;
  }
  return bytes.substr(0, 5) != "solid";
}

}  // namespace

TriangleMesh read_stl(std::string_view bytes) {
  auto corners = is_binary(bytes) ? read_binary_corners(bytes) : read_ascii_corners(bytes);
  if (corners.size() >= std::numeric_limits<uint32_t>::max())
    throw InputError("has more than 2^32 - 2 corners");
  for (size_t i = 0; i < corners.size(); i++)  // before welding, for which NaN equals nothing
    for (float c : corners[i])
      if (!std::isfinite(c))
        throw InputError("triangle " + std::to_string(i / 3) + " vertex " + std::to_string(i % 3) +
                         " has a coordinate that is not finite");
  std::vector<uint32_t> vertex = weld_positions(corners);
  TriangleMesh mesh;
  mesh.triangles.reserve(corners.size() / 3);
  uint32_t count = 0;
  for (size_t i = 0; i < corners.size(); i++) {  // number the first of each group in order
    bool first = vertex[i] == i;
    if (first) mesh.positions.push_back(corners[i]);
    vertex[i] = first ? count++ : vertex[vertex[i]];
  }
  for (size_t i = 0; i + 2 < corners.size(); i += 3)
    mesh.triangles.push_back({vertex[i], vertex[i + 1], vertex[i + 2]});
  return mesh;
}

}  // namespace relief
