// Scenes of one primitive: a stream, or a plain mesh.
#include "gltf/accessors.h"
#include "gltf/gltf.h"

namespace relief {

void write_stream_gltf(const std::string& out, const std::vector<uint8_t>& stream, bool points) {
  TriangleMesh mesh = decode(stream.data(), stream.size());
  Document document = one_primitive_document();
  document.directory = std::filesystem::path(out).parent_path();
  add_name(document.json, "extensionsUsed", kExtension);
  add_name(document.json, "extensionsRequired", kExtension);
  size_t color = 0, position = append(document.json, "accessors", position_accessor(mesh));
  size_t normal = append(document.json, "accessors", normal_accessor(mesh));
  if (!mesh.colors.empty()) color = append(document.json, "accessors", color_accessor(mesh));
  size_t indices = points ? 0 : append(document.json, "accessors", index_accessor(mesh));
  size_t view = append_view(document, stream);
  Json& primitive = document.json["meshes"][0]["primitives"][0];
  primitive["attributes"] = {{"POSITION", position}, {"NORMAL", normal}};
  if (!mesh.colors.empty()) primitive["attributes"]["COLOR_0"] = color;
  if (points)
    primitive["mode"] = 0u;
  else
    primitive["indices"] = indices;
  primitive["extensions"] = {{kExtension, {{"bufferView", view}}}};
  save_document(std::move(document), out);
}

void write_mesh_gltf(const std::string& out, const TriangleMesh& mesh) {
  Document document = one_primitive_document();
  document.directory = std::filesystem::path(out).parent_path();
  Json& root = document.json;
  Json attributes;
  auto add = [&](Json accessor, const Bytes& bytes, unsigned target) {
    accessor["bufferView"] = append_vertex_view(document, bytes, target);
    return append(root, "accessors", std::move(accessor));
  };
  attributes["POSITION"] = add(position_accessor(mesh), position_bytes(mesh), kArrayBuffer);
  if (!mesh.normals.empty())
    attributes["NORMAL"] = add(normal_accessor(mesh), normal_bytes(mesh), kArrayBuffer);
  if (!mesh.colors.empty())
    attributes["COLOR_0"] = add(color_accessor(mesh), color_bytes(mesh), kArrayBuffer);
  Json& primitive = root["meshes"][0]["primitives"][0];
  primitive["attributes"] = std::move(attributes);
  if (mesh.triangles.empty())
    primitive["mode"] = 0u;
  else
    primitive["indices"] = add(index_accessor(mesh), index_bytes(mesh), kElementArrayBuffer);
  save_document(std::move(document), out);
}

}  // namespace relief
