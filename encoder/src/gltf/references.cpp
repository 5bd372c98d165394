#include "gltf/references.h"

#include <array>

namespace relief {

namespace {

using Visit = std::function<void(const Reference&)>;

void each(Json* array, const std::function<void(Json&)>& f) {
  if (array && array->is_structured())
    for (Json& item : *array) f(item);
}

void visit_one(Json* index, Referred to, Role role, size_t owner, const Visit& visit) {
  if (index) visit({to, role, owner, index});
}

Json* extension(Json& object, const char* name) {
  Json* extensions = find(object, "extensions");
  return extensions ? find(*extensions, name) : nullptr;
}

void visit_primitive(Json& primitive, const Visit& visit) {
  auto accessor = [&](Json& index) { visit_one(&index, Referred::kAccessor, Role::kPrimitive, 0, visit); };
  each(find(primitive, "attributes"), accessor);
  if (Json* indices = find(primitive, "indices")) accessor(*indices);
  each(find(primitive, "targets"), [&](Json& target) {
    if (target.is_object()) each(&target, accessor);
  });
  for (const char* name : {"KHR_draco_mesh_compression", kExtension})
    if (Json* codec = extension(primitive, name))
      visit_one(find(*codec, "bufferView"), Referred::kView, Role::kPlain, 0, visit);
}

void visit_accessor(Json& accessor, size_t i, const Visit& visit) {
  visit_one(find(accessor, "bufferView"), Referred::kView, Role::kAccessorData, i, visit);
  if (Json* sparse = find(accessor, "sparse"))
    for (const char* part : {"indices", "values"})
      if (Json* p = find(*sparse, part))
        visit_one(find(*p, "bufferView"), Referred::kView, Role::kPlain, i, visit);
}

void visit_animation(Json& animation, const Visit& visit) {
  each(find(animation, "samplers"), [&](Json& sampler) {
    for (const char* end : {"input", "output"})
      visit_one(find(sampler, end), Referred::kAccessor, Role::kPlain, 0, visit);
  });
}

void visit_view(Json& view, const Visit& visit) {
  visit_one(find(view, "buffer"), Referred::kBuffer, Role::kPlain, 0, visit);
  for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
    if (Json* codec = extension(view, name))
      visit_one(find(*codec, "buffer"), Referred::kBuffer, Role::kPlain, 0, visit);
}

}  // namespace

void for_each_reference(Json& root, const Visit& visit) {
  each(find(root, "meshes"), [&](Json& mesh) {
    each(find(mesh, "primitives"), [&](Json& primitive) { visit_primitive(primitive, visit); });
  });
  each(find(root, "skins"), [&](Json& skin) {
    visit_one(find(skin, "inverseBindMatrices"), Referred::kAccessor, Role::kPlain, 0, visit);
  });
  each(find(root, "animations"), [&](Json& animation) { visit_animation(animation, visit); });
  each(find(root, "nodes"), [&](Json& node) {
    if (Json* instancing = extension(node, "EXT_mesh_gpu_instancing"))
      each(find(*instancing, "attributes"),
           [&](Json& index) { visit_one(&index, Referred::kAccessor, Role::kPlain, 0, visit); });
  });
  size_t i = 0;
  each(find(root, "accessors"), [&](Json& accessor) { visit_accessor(accessor, i++, visit); });
  each(find(root, "images"),
       [&](Json& image) { visit_one(find(image, "bufferView"), Referred::kView, Role::kPlain, 0, visit); });
  each(find(root, "bufferViews"), [&](Json& view) { visit_view(view, visit); });
}

// --- What we do not know
// -------------------------------------------------------------------------------------------

namespace {

bool holds_integer(const Json& value) {
  if (value.is_number_integer()) return true;
  if (value.is_structured())
    for (const Json& item : value)
      if (holds_integer(item)) return true;
  return false;
}

bool sounds_like_reference(std::string key, bool extras) {
  for (char& c : key) c = char(std::tolower(static_cast<unsigned char>(c)));
  if (key.find("accessor") != std::string::npos || key.find("buffer") != std::string::npos) return true;
  return !extras && (key == "attributes" || key == "indices" || key == "values");
}

bool holds_reference(const Json& value, bool extras) {
  if (!value.is_structured()) return false;
  if (value.is_object()) {
    for (const auto& [key, member] : value.items())
      if (sounds_like_reference(key, extras) && holds_integer(member)) return true;
  }
  for (const Json& item : value)
    if (holds_reference(item, extras)) return true;
  return false;
}

bool known(const std::string& name) {
  static const std::array<const char*, 5> names = {"KHR_draco_mesh_compression", "EXT_meshopt_compression",
                                                   "KHR_meshopt_compression", "EXT_mesh_gpu_instancing",
                                                   kExtension};
  for (const char* n : names)
    if (name == n) return true;
  return false;
}

}  // namespace

std::string unknown_referrer(const Json& root) {
  if (!root.is_structured()) return "";
  if (root.is_object()) {
    if (const Json* extensions = find(root, "extensions"))
      if (extensions->is_object())
        for (const auto& [name, value] : extensions->items())
          if (!known(name) && holds_reference(value, false)) return name;
    if (const Json* extras = find(root, "extras"))
      if (holds_reference(*extras, true)) return "extras";
  }
  for (const auto& [key, value] : root.items()) {
    if (key == "extras") continue;
    if (std::string name = unknown_referrer(value); !name.empty()) return name;
  }
  return "";
}

}  // namespace relief
