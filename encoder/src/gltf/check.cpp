#include "gltf/check.h"

#include "gltf/references.h"

namespace relief {

namespace {

[[noreturn]] void fail(const std::string& where, const char* key, const char* what) {
  throw InputError(where + "." + key + " " + what);
}

// Calls f(item, "name[i]") for the items of an array of objects, which may be absent.
template <typename F>
void each_object(Json& owner, const std::string& where, const char* key, F f) {
  Json* array = find(owner, key);
  std::string name = where.empty() ? key : where + "." + key;
  if (!array) return;
  if (!array->is_array()) throw InputError(name + " is not an array");
  for (size_t i = 0; i < array->size(); i++) {
    std::string item_name = name + "[" + std::to_string(i) + "]";
    if (!(*array)[i].is_object()) throw InputError(item_name + " is not an object");
    f((*array)[i], item_name);
  }
}

enum Need { kOptional, kRequired };

void check_unsigned(Json& object, const std::string& where, const char* key, Need need) {
  const Json* value = find(object, key);
  if (!value && need == kRequired) fail(where, key, "is missing");
  if (value && !value->is_number_unsigned()) fail(where, key, "is not a non-negative integer");
}

void check_string(Json& object, const std::string& where, const char* key, Need need) {
  const Json* value = find(object, key);
  if (!value && need == kRequired) fail(where, key, "is missing");
  if (value && !value->is_string()) fail(where, key, "is not a string");
}

Json& check_object(Json& object, const std::string& where, const char* key) {
  Json* value = find(object, key);
  if (!value || !value->is_object()) fail(where, key, "is missing or not an object");
  return *value;
}

void check_numbers(Json& object, const std::string& where, const char* key, size_t count) {
  const Json* value = find(object, key);
  if (!value) return;
  bool good = value->is_array() && value->size() == count;
  if (good)
    for (const Json& number : *value) good = good && number.is_number();
  if (!good) fail(where, key, ("is not an array of " + std::to_string(count) + " numbers").c_str());
}

void check_index(const Json& index, size_t size, const std::string& where, const char* key) {
  if (!index.is_number_unsigned()) fail(where, key, "is not an index");
  if (index.get<uint64_t>() >= size) fail(where, key, ("is out of range: " + index.dump()).c_str());
}

void check_index_array(Json& object, const std::string& where, const char* key, size_t size) {
  const Json* value = find(object, key);
  if (!value) return;
  if (!value->is_array()) fail(where, key, "is not an array");
  for (const Json& index : *value) check_index(index, size, where, key);
}

size_t size_of(const Json& root, const char* key) {
  const Json* array = find(root, key);
  return array ? array->size() : 0;
}

void check_version(Json& root) {
  Json& asset = check_object(root, "file", "asset");
  check_string(asset, "asset", "version", kRequired);
  std::string version = asset["version"].get<std::string>();
  if (version.rfind("2.", 0) != 0) throw InputError("is glTF version '" + version + "', not 2.x");
}

void check_accessor(Json& accessor, const std::string& where) {
  check_unsigned(accessor, where, "componentType", kRequired);
  check_unsigned(accessor, where, "count", kRequired);
  check_unsigned(accessor, where, "byteOffset", kOptional);
  check_string(accessor, where, "type", kRequired);
  if (const Json* n = find(accessor, "normalized"); n && !n->is_boolean())
    fail(where, "normalized", "is not a boolean");
  if (!find(accessor, "sparse")) return;
  Json& sparse = check_object(accessor, where, "sparse");
  check_unsigned(sparse, where + ".sparse", "count", kRequired);
  for (const char* name : {"indices", "values"}) {
    Json& part = check_object(sparse, where + ".sparse", name);
    check_unsigned(part, where + ".sparse." + name, "bufferView", kRequired);
    check_unsigned(part, where + ".sparse." + name, "byteOffset", kOptional);
  }
  check_unsigned(sparse["indices"], where + ".sparse.indices", "componentType", kRequired);
}

void check_mesh(Json& mesh, const std::string& where) {
  if (!find(mesh, "primitives")) fail(where, "primitives", "is missing");
  each_object(mesh, where, "primitives", [&](Json& primitive, const std::string& name) {
    check_object(primitive, name, "attributes");
    check_unsigned(primitive, name, "mode", kOptional);
    each_object(primitive, name, "targets", [](Json&, const std::string&) {});
    const Json* extensions = find(primitive, "extensions");
    const Json* ours = extensions ? find(*extensions, kExtension) : nullptr;
    if (ours && !find(*ours, "bufferView")) fail(name, kExtension, "has no bufferView");
  });
}

void check_node(Json& node, const std::string& where, const Json& root) {
  if (const Json* mesh = find(node, "mesh")) check_index(*mesh, size_of(root, "meshes"), where, "mesh");
  check_index_array(node, where, "children", size_of(root, "nodes"));
  check_numbers(node, where, "matrix", 16);
  check_numbers(node, where, "translation", 3);
  check_numbers(node, where, "rotation", 4);
  check_numbers(node, where, "scale", 3);
}

void check_references(Json& root) {
  const size_t sizes[] = {size_of(root, "accessors"), size_of(root, "bufferViews"), size_of(root, "buffers")};
  const char* names[] = {"accessor", "bufferView", "buffer"};
  for_each_reference(root, [&](const Reference& r) {
    const char* name = names[int(r.to)];
    if (!r.index->is_number_unsigned()) throw InputError(std::string(name) + " index is not an integer");
    if (r.index->get<uint64_t>() >= sizes[int(r.to)])
      throw InputError(std::string(name) + " index " + r.index->dump() + " is out of range");
  });
}

}  // namespace

void check_json(Json& root) {
  if (!root.is_object()) throw InputError("is not a glTF file: the JSON is not an object");
  check_version(root);
  for (const char* key : {"images", "skins", "animations", "materials"})
    each_object(root, "", key, [](Json&, const std::string&) {});
  each_object(root, "", "accessors", check_accessor);
  each_object(root, "", "bufferViews", [](Json& view, const std::string& where) {
    check_unsigned(view, where, "buffer", kRequired);
    check_unsigned(view, where, "byteLength", kRequired);
    if (view["byteLength"] == 0u) fail(where, "byteLength", "is zero");
    check_unsigned(view, where, "byteOffset", kOptional);
    check_unsigned(view, where, "byteStride", kOptional);
  });
  each_object(root, "", "buffers", [](Json& buffer, const std::string& where) {
    check_unsigned(buffer, where, "byteLength", kRequired);
    check_string(buffer, where, "uri", kOptional);
  });
  each_object(root, "", "meshes", check_mesh);
  each_object(root, "", "nodes",
              [&](Json& node, const std::string& where) { check_node(node, where, root); });
  each_object(root, "", "scenes", [&](Json& scene, const std::string& where) {
    check_index_array(scene, where, "nodes", size_of(root, "nodes"));
  });
  if (const Json* scene = find(root, "scene")) check_index(*scene, size_of(root, "scenes"), "file", "scene");
  for (const char* key : {"extensionsUsed", "extensionsRequired"})
    if (const Json* list = find(root, key)) {
      if (!list->is_array()) fail("file", key, "is not an array");
      for (const Json& name : *list)
        if (!name.is_string()) fail("file", key, "holds something that is not a string");
    }
  check_references(root);
}

}  // namespace relief
