// Replaces compressed primitives by plain ones: triangles, or points.
#include <map>
#include <set>

#include "gltf/accessors.h"
#include "gltf/compact.h"
#include "gltf/gltf.h"
#include "gltf/references.h"

namespace relief {

namespace {

// The accessors of one stream, filled with its data.
struct Filled {
  size_t position, normal, indices, color;
};

// Gives an accessor its data. The JSON may name any accessor, so one that has data already, or is missing, is
// not touched but replaced by a new one.
size_t fill_accessor(Document& document, const Json* old, const Json& fresh, const Bytes& bytes,
                     unsigned target) {
  size_t view = append_vertex_view(document, bytes, target);
  bool reusable = old && !document.json["accessors"][old->get<size_t>()].contains("bufferView") &&
                  !document.json["accessors"][old->get<size_t>()].contains("sparse");
  size_t index = reusable ? old->get<size_t>() : append(document.json, "accessors", fresh);
  Json& accessor = document.json["accessors"][index];
  accessor["bufferView"] = view;
  for (const auto& [key, value] : fresh.items()) accessor[key] = value;
  return index;
}

Filled fill_accessors(Document& document, const Json& primitive, const TriangleMesh& mesh, bool points) {
  const Json& attributes = primitive["attributes"];
  Filled filled{};
  filled.position = fill_accessor(document, find(attributes, "POSITION"), position_accessor(mesh),
                                  position_bytes(mesh), kArrayBuffer);
  filled.normal = fill_accessor(document, find(attributes, "NORMAL"), normal_accessor(mesh),
                                normal_bytes(mesh), kArrayBuffer);
  const Json* color = find(attributes, "COLOR_0");
  if (color && mesh.colors.empty())
    throw InputError("a compressed primitive has the attribute COLOR_0, which its stream does not hold");
  if (color)
    filled.color = fill_accessor(document, color, color_accessor(mesh), color_bytes(mesh), kArrayBuffer);
  if (!points)
    filled.indices = fill_accessor(document, find(primitive, "indices"), index_accessor(mesh),
                                   index_bytes(mesh), kElementArrayBuffer);
  return filled;
}

void check_attributes(const Json& primitive) {
  for (const auto& [name, accessor] : primitive["attributes"].items())
    if (name != "POSITION" && name != "NORMAL" && name != "COLOR_0")
      throw InputError("a compressed primitive has the attribute " + name +
                       ", which its stream does not hold");
}

void replace_primitive(Document& document, size_t m, size_t i, bool points, std::map<int64_t, Filled>& done) {
  Json old = document.json["meshes"][m]["primitives"][i];
  int64_t view = stream_view(old);
  check_attributes(old);
  if (!done.count(view)) {
    Span stream = view_bytes(document, size_t(view));
    done[view] = fill_accessors(document, old, decode(stream.data, stream.size, document.decoding), points);
  }
  const Filled& filled = done[view];
  Json& json = document.json["meshes"][m]["primitives"][i];
  json["attributes"]["POSITION"] = filled.position;
  json["attributes"]["NORMAL"] = filled.normal;
  if (json["attributes"].contains("COLOR_0")) json["attributes"]["COLOR_0"] = filled.color;
  if (points) {
    json.erase("indices");
    json["mode"] = 0u;
  } else {
    json["indices"] = filled.indices;
    if (json.contains("mode")) json["mode"] = 4u;
  }
  json["extensions"].erase(kExtension);
  if (json["extensions"].empty()) json.erase("extensions");
}

}  // namespace

size_t decompress_gltf(const std::string& in, const std::string& out, const DecodeOptions& options) {
  Document document = load_document(in);
  document.decoding = options;
  std::map<int64_t, Filled> done;
  std::set<size_t> old_accessors;
  size_t count = 0;
  Json& root = document.json;
  for (size_t m = 0; root.contains("meshes") && m < root["meshes"].size(); m++)
    for (size_t i = 0; i < root["meshes"][m]["primitives"].size(); i++) {
      const Json& primitive = root["meshes"][m]["primitives"][i];
      if (stream_view(primitive) < 0) continue;
      for (const Json& accessor : primitive["attributes"]) old_accessors.insert(accessor.get<size_t>());
      if (const Json* indices = find(primitive, "indices")) old_accessors.insert(indices->get<size_t>());
      replace_primitive(document, m, i, options.points, done);
      count++;
    }
  if (count > 0) {
    remove_name(root, "extensionsUsed", kExtension);
    remove_name(root, "extensionsRequired", kExtension);
    std::set<size_t> streams;
    for (const auto& [view, filled] : done) streams.insert(size_t(view));
    if (unknown_referrer(root).empty()) compact(document, old_accessors, streams);
  }
  save_document(std::move(document), out);
  return count;
}

}  // namespace relief
