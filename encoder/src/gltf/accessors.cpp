#include "gltf/accessors.h"

#include <algorithm>
#include <cstring>

#include "gltf/srgb.h"

namespace relief {

namespace {

constexpr unsigned kFloat = 5126, kUnsignedInt = 5125, kUnsignedShort = 5123;

template <typename T>
Bytes bytes_of(const std::vector<T>& values) {
  Bytes bytes(values.size() * sizeof(T));
  if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

}  // namespace

Json position_accessor(const TriangleMesh& mesh) {
  std::array<float, 3> low = mesh.positions.at(0), high = low;
  for (const auto& p : mesh.positions)
    for (size_t k = 0; k < 3; k++) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  return {{"componentType", kFloat},
          {"count", mesh.positions.size()},
          {"type", "VEC3"},
          {"min", low},
          {"max", high}};
}

Json normal_accessor(const TriangleMesh& mesh) {
  return {{"componentType", kFloat}, {"count", mesh.positions.size()}, {"type", "VEC3"}};
}

Json color_accessor(const TriangleMesh& mesh) {
  return {{"componentType", kUnsignedShort},
          {"normalized", true},
          {"count", mesh.positions.size()},
          {"type", "VEC4"}};
}

Json index_accessor(const TriangleMesh& mesh) {
  return {{"componentType", kUnsignedInt}, {"count", 3 * mesh.triangles.size()}, {"type", "SCALAR"}};
}

Bytes position_bytes(const TriangleMesh& mesh) { return bytes_of(mesh.positions); }
Bytes normal_bytes(const TriangleMesh& mesh) { return bytes_of(mesh.normals); }
Bytes color_bytes(const TriangleMesh& mesh) {
  std::array<uint16_t, 256> linear;
  for (size_t i = 0; i < linear.size(); i++) linear[i] = linear_of(uint8_t(i));
  std::vector<std::array<uint16_t, 4>> colors;
  colors.reserve(mesh.colors.size());
  for (const auto& [red, green, blue, opacity] : mesh.colors)
    colors.push_back({linear[red], linear[green], linear[blue], uint16_t(257 * opacity)});
  return bytes_of(colors);
}
Bytes index_bytes(const TriangleMesh& mesh) { return bytes_of(mesh.triangles); }

size_t append_vertex_view(Document& document, const Bytes& bytes, unsigned target) {
  size_t view = append_view(document, bytes);
  document.json["bufferViews"][view]["target"] = target;
  return view;
}

Document one_primitive_document() {
  Document document;
  document.json = {{"asset", {{"version", "2.0"}, {"generator", "relief"}}},
                   {"scene", 0u},
                   {"scenes", {{{"nodes", {0u}}}}},
                   {"nodes", {{{"mesh", 0u}}}},
                   {"meshes", {{{"primitives", {{{"attributes", Json::object()}}}}}}}};
  return document;
}

void add_name(Json& root, const char* list, const char* name) {
  if (!find(root, list)) root[list] = Json::array();
  Json& names = root[list];
  if (std::find(names.begin(), names.end(), Json(name)) == names.end()) names.push_back(name);
}

void remove_name(Json& root, const char* list, const char* name) {
  Json* names = find(root, list);
  if (!names) return;
  names->erase(std::remove(names->begin(), names->end(), Json(name)), names->end());
  if (names->empty()) root.erase(list);
}

}  // namespace relief
