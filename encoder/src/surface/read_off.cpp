// OFF (Object File Format, Geomview), text: OFF, COFF, NOFF, STOFF and their combinations.
#include <limits>

#include "surface/polygons.h"
#include "surface/readers.h"
#include "surface/text_scanner.h"

namespace relief {
namespace {

// Reads the keyword; the counts may follow on the same line. Returns whether vertices carry normals.
bool parse_keyword(TextScanner& in) {
  in.skip_space_and_comments();
  std::string_view keyword = in.word();
  if (keyword.size() < 3 || keyword.substr(keyword.size() - 3) != "OFF")
    throw InputError("is not an OFF file (it does not begin with 'OFF')");
  std::string_view prefix = keyword.substr(0, keyword.size() - 3);
  if (prefix.substr(0, 2) == "ST") prefix.remove_prefix(2);
  if (prefix.substr(0, 1) == "C") prefix.remove_prefix(1);
  bool normals = prefix.substr(0, 1) == "N";
  if (normals) prefix.remove_prefix(1);
  if (!prefix.empty())
    throw InputError("OFF files of the kind '" + std::string(keyword) + "' cannot be read");
  return normals;
}

uint64_t parse_count(TextScanner& in, const char* what) {
  in.skip_space_and_comments();
  int64_t count = in.integer();
  if (count < 0 || count > int64_t(std::numeric_limits<uint32_t>::max()))
    in.fail(std::string("the number of ") + what + " is out of range");
  return uint64_t(count);
}

}  // namespace

TriangleMesh read_off(std::string_view bytes) {
  TextScanner in(bytes);
  bool normals = parse_keyword(in);
  if (in.more_on_line()) {
    TextScanner rest = in;
    if (rest.word() == "BINARY") throw InputError("binary OFF files cannot be read");
  }
  uint64_t vertex_count = parse_count(in, "vertices"), face_count = parse_count(in, "faces");
  in.skip_line();  // the number of edges, which nobody keeps right
  // "0 0 0\n" is the shortest vertex, "0\n" the shortest face.
  if (vertex_count > (in.remaining() + 1) / 6 || face_count > (in.remaining() + 1) / 2)
    throw InputError("the file is too short for its " + std::to_string(vertex_count) + " vertices and " +
                     std::to_string(face_count) + " faces");

  TriangleMesh mesh;
  mesh.positions.resize(vertex_count);
  if (normals) mesh.normals.resize(vertex_count);
  for (uint64_t i = 0; i < vertex_count; i++) {
    in.skip_space_and_comments();
    for (float& c : mesh.positions[i]) c = in.number();
    if (normals)
      for (float& c : mesh.normals[i]) c = in.number();
    in.skip_line();  // colours, texture coordinates
  }
  mesh.triangles.reserve(face_count);
  PolygonFan fan(mesh, vertex_count);
  for (uint64_t i = 0; i < face_count; i++) {
    in.skip_space_and_comments();
    fan.begin_face();
    for (int64_t k = in.integer(); k > 0; k--) fan.corner(in.integer());
    in.skip_line();  // a colour
  }
  return mesh;
}

}  // namespace relief
