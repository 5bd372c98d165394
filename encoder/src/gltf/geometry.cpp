#include "gltf/geometry.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "gltf/srgb.h"

namespace relief {

namespace {

constexpr uint32_t kUnused = std::numeric_limits<uint32_t>::max();

Json pick(const Json& object, std::initializer_list<const char*> keys) {
  Json picked = Json::object();
  for (const char* key : keys)
    if (const Json* value = find(object, key)) picked[key] = *value;
  return picked;
}

void pick_array(const Json& from, Json& to, const char* name, std::initializer_list<const char*> keys) {
  const Json* array = find(from, name);
  if (!array) return;
  to[name] = Json::array();
  for (const Json& item : *array) to[name].push_back(pick(item, keys));
}

bool has_view(const Document& document, const Json& accessor_index) {
  return document.json["accessors"][accessor_index.get<size_t>()].contains("bufferView");
}

// What tinygltf is to see: it refuses a file in which an index accessor has no buffer view, as is the case in
// primitives that an extension compresses.
Json geometry_json(const Document& document) {
  const Json& root = document.json;
  Json picked = pick(root, {"asset", "scene"});
  pick_array(root, picked, "scenes", {"nodes"});
  pick_array(root, picked, "nodes", {"mesh", "children", "matrix", "translation", "rotation", "scale"});
  pick_array(root, picked, "bufferViews", {"buffer", "byteOffset", "byteLength", "byteStride"});
  pick_array(root, picked, "accessors",
             {"bufferView", "byteOffset", "componentType", "normalized", "count", "type", "sparse"});
  const Json* meshes = find(root, "meshes");
  if (!meshes) return picked;
  picked["meshes"] = Json::array();
  for (const Json& mesh : *meshes) {
    Json primitives = Json::array();
    for (const Json& primitive : mesh.at("primitives")) {
      primitives.push_back(pick(primitive, {"attributes", "indices", "mode"}));
      const Json* indices = find(primitive, "indices");
      if (indices && !has_view(document, *indices)) primitives.back().erase("indices");
    }
    picked["meshes"].push_back({{"primitives", std::move(primitives)}});
  }
  return picked;
}

std::string one_line(std::string text) {
  for (char& c : text)
    if (c == '\n' || c == '\r') c = ' ';
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

// `count` elements of `size` bytes in a buffer view.
struct Elements {
  const uint8_t* data;
  size_t stride;
};

Elements view_elements(const Document& document, const tinygltf::Model& model, int view, uint64_t offset,
                       size_t size, uint64_t count, const std::string& what) {
  if (view < 0 || size_t(view) >= model.bufferViews.size()) throw InputError(what + " has no buffer view");
  Span span = view_bytes(document, size_t(view));
  size_t stride = model.bufferViews[size_t(view)].byteStride;
  if (stride == 0) stride = size;
  if (stride < size) throw InputError(what + " has a stride smaller than its elements");
  bool fits = count == 0 || (offset <= span.size && size <= span.size - offset &&
                             count - 1 <= (span.size - offset - size) / stride);
  if (!fits) throw InputError(what + " exceeds its buffer view");
  return {span.data + offset, stride};
}

template <typename T>
T load(const uint8_t* p) {
  T value;
  std::memcpy(&value, p, sizeof(T));
  return value;
}

uint32_t load_index(const uint8_t* p, int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return *p;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load<uint16_t>(p);
    default:
      return load<uint32_t>(p);
  }
}

// glTF 2.0, 3.6.2.2: normalised integers.
float load_component(const uint8_t* p, int type, bool normalized) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return load<float>(p);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return normalized ? *p / 255.0f : *p;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: {
      float v = load<uint16_t>(p);
      return normalized ? v / 65535.0f : v;
    }
    case TINYGLTF_COMPONENT_TYPE_BYTE: {
      float v = load<int8_t>(p);
      return normalized ? std::max(v / 127.0f, -1.0f) : v;
    }
    default: {
      float v = load<int16_t>(p);
      return normalized ? std::max(v / 32767.0f, -1.0f) : v;
    }
  }
}

bool is_index_type(int type) {
  return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
         type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

std::string accessor_name(int accessor) { return "accessor " + std::to_string(accessor); }

const tinygltf::Accessor& accessor_of(const tinygltf::Model& model, int index) {
  return model.accessors.at(size_t(index));
}

// Overwrites the elements that a sparse accessor lists: store(element, bytes).
template <typename Store>
void read_sparse(const Document& document, const tinygltf::Model& model, int index, size_t size,
                 Store store) {
  const tinygltf::Accessor& a = accessor_of(model, index);
  if (!a.sparse.isSparse) return;
  const auto& s = a.sparse;
  std::string name = accessor_name(index) + " sparse";
  if (s.count < 0 || size_t(s.count) > a.count || s.indices.byteOffset < 0 || s.values.byteOffset < 0)
    throw InputError(name + " has a count out of range");
  if (!is_index_type(s.indices.componentType)) throw InputError(name + " indices have a wrong type");
  size_t index_size = size_t(tinygltf::GetComponentSizeInBytes(uint32_t(s.indices.componentType)));
  Elements indices = view_elements(document, model, s.indices.bufferView, uint64_t(s.indices.byteOffset),
                                   index_size, uint64_t(s.count), name + " indices");
  Elements values = view_elements(document, model, s.values.bufferView, uint64_t(s.values.byteOffset), size,
                                  uint64_t(s.count), name + " values");
  for (size_t i = 0; i < size_t(s.count); i++) {
    uint32_t element = load_index(indices.data + i * indices.stride, s.indices.componentType);
    if (element >= a.count) throw InputError(name + " index is out of range");
    store(element, values.data + i * values.stride);
  }
}

// An accessor without a buffer view holds zeros. A count that only the JSON vouches for must not size an
// allocation beyond this.
constexpr size_t kMaxElementsWithoutBytes = 1 << 24;

void check_count(const tinygltf::Accessor& a, int index) {
  if (a.bufferView >= 0) return;
  if (a.count > kMaxElementsWithoutBytes) throw InputError(accessor_name(index) + " has too many elements");
}

std::vector<uint32_t> read_indices(const Document& document, const tinygltf::Model& model, int index) {
  const tinygltf::Accessor& a = accessor_of(model, index);
  if (a.type != TINYGLTF_TYPE_SCALAR || !is_index_type(a.componentType) || a.normalized)
    throw InputError(accessor_name(index) + " holds no indices: wrong type");
  check_count(a, index);
  size_t size = size_t(tinygltf::GetComponentSizeInBytes(uint32_t(a.componentType)));
  std::vector<uint32_t> indices;
  if (a.bufferView >= 0) {
    Elements e =
        view_elements(document, model, a.bufferView, a.byteOffset, size, a.count, accessor_name(index));
    indices.resize(a.count);
    for (size_t i = 0; i < a.count; i++) indices[i] = load_index(e.data + i * e.stride, a.componentType);
  }
  indices.resize(a.count);
  read_sparse(document, model, index, size,
              [&](uint32_t i, const uint8_t* p) { indices[i] = load_index(p, a.componentType); });
  return indices;
}

// The elements of an accessor whose type was checked, as floats.
template <size_t N>
std::vector<std::array<float, N>> read_vectors(const Document& document, const tinygltf::Model& model,
                                               int index) {
  const tinygltf::Accessor& a = accessor_of(model, index);
  check_count(a, index);
  size_t component = size_t(tinygltf::GetComponentSizeInBytes(uint32_t(a.componentType)));
  std::vector<std::array<float, N>> values;
  auto store = [&](size_t i, const uint8_t* p) {
    for (size_t k = 0; k < N; k++)
      values[i][k] = load_component(p + k * component, a.componentType, a.normalized);
  };
  if (a.bufferView >= 0) {
    Elements e = view_elements(document, model, a.bufferView, a.byteOffset, N * component, a.count,
                               accessor_name(index));
    values.resize(a.count);
    for (size_t i = 0; i < a.count; i++) store(i, e.data + i * e.stride);
  }
  values.resize(a.count);
  read_sparse(document, model, index, N * component, store);
  return values;
}

// Of COLOR_0, as sRGB.
std::vector<std::array<uint8_t, 4>> read_colors(const Document& document, const tinygltf::Model& model,
                                                int index) {
  const tinygltf::Accessor& a = accessor_of(model, index);
  const bool integer = a.normalized && (a.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
                                        a.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT);
  if (!(integer || a.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT) ||
      !(a.type == TINYGLTF_TYPE_VEC3 || a.type == TINYGLTF_TYPE_VEC4))
    throw InputError(accessor_name(index) + " holds no colours: wrong type");
  std::vector<std::array<uint8_t, 4>> colors;
  auto add = [&](float red, float green, float blue, float opacity) {
    const float cut = opacity > 0 ? std::min(opacity, 1.0f) : 0;
    colors.push_back({srgb_of(red), srgb_of(green), srgb_of(blue), uint8_t(std::lround(255 * cut))});
  };
  if (a.type == TINYGLTF_TYPE_VEC3)
    for (const auto& c : read_vectors<3>(document, model, index)) add(c[0], c[1], c[2], 1);
  else
    for (const auto& c : read_vectors<4>(document, model, index)) add(c[0], c[1], c[2], c[3]);
  return colors;
}

// Modes 4, 5 and 6 as a list of triangles, counter-clockwise as glTF 2.0, 3.7.2.1 defines it.
std::vector<std::array<uint32_t, 3>> list_triangles(const std::vector<uint32_t>& v, int mode) {
  std::vector<std::array<uint32_t, 3>> triangles;
  if (v.size() < 3) return triangles;
  size_t count = mode == TINYGLTF_MODE_TRIANGLES ? v.size() / 3 : v.size() - 2;
  triangles.reserve(count);
  for (size_t i = 0; i < count; i++) {
    std::array<uint32_t, 3> t;
    if (mode == TINYGLTF_MODE_TRIANGLES)
      t = {v[3 * i], v[3 * i + 1], v[3 * i + 2]};
    else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP)
      t = {v[i], v[i + 1 + i % 2], v[i + 2 - i % 2]};
    else
      t = {v[i + 1], v[i + 2], v[0]};
    bool stitch = mode != TINYGLTF_MODE_TRIANGLES && (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]);
    if (!stitch) triangles.push_back(t);
  }
  return triangles;
}

void drop_unused_vertices(TriangleMesh& mesh) {
  std::vector<uint32_t> renumbered(mesh.positions.size(), kUnused);
  for (const auto& t : mesh.triangles)
    for (uint32_t v : t) renumbered[v] = 0;
  uint32_t used = 0;
  for (size_t v = 0; v < renumbered.size(); v++) {
    if (renumbered[v] == kUnused) continue;
    mesh.positions[used] = mesh.positions[v];
    if (!mesh.normals.empty()) mesh.normals[used] = mesh.normals[v];
    if (!mesh.colors.empty()) mesh.colors[used] = mesh.colors[v];
    renumbered[v] = used++;
  }
  mesh.positions.resize(used);
  if (!mesh.normals.empty()) mesh.normals.resize(used);
  if (!mesh.colors.empty()) mesh.colors.resize(used);
  for (auto& t : mesh.triangles)
    for (uint32_t& v : t) v = renumbered[v];
}

TriangleMesh pick_points(const TriangleMesh& all, const std::vector<uint32_t>& indices) {
  TriangleMesh points;
  for (uint32_t i : indices) {
    points.positions.push_back(all.positions[i]);
    if (!all.normals.empty()) points.normals.push_back(all.normals[i]);
    if (!all.colors.empty()) points.colors.push_back(all.colors[i]);
  }
  return points;
}

TriangleMesh read_plain(const Document& document, const tinygltf::Model& model,
                        const tinygltf::Primitive& primitive) {
  TriangleMesh mesh;
  auto position = primitive.attributes.find("POSITION");
  if (position == primitive.attributes.end()) throw InputError("has no POSITION");
  mesh.positions = read_float3(document, model, position->second);
  if (mesh.positions.size() >= kUnused) throw InputError("has too many vertices");
  for (size_t i = 0; i < mesh.positions.size(); i++)
    for (float c : mesh.positions[i])
      if (!std::isfinite(c)) throw InputError("vertex " + std::to_string(i) + " is not finite");
  auto normal = primitive.attributes.find("NORMAL");
  if (normal != primitive.attributes.end()) {
    mesh.normals = read_float3(document, model, normal->second);
    if (mesh.normals.size() != mesh.positions.size())
      throw InputError("has more or fewer normals than positions");
  }
  auto color = primitive.attributes.find("COLOR_0");
  if (color != primitive.attributes.end()) {
    mesh.colors = read_colors(document, model, color->second);
    if (mesh.colors.size() != mesh.positions.size())
      throw InputError("has more or fewer colours than positions");
  }
  std::vector<uint32_t> indices;
  if (primitive.indices >= 0) {
    indices = read_indices(document, model, primitive.indices);
  } else {
    indices.resize(mesh.positions.size());
    for (size_t i = 0; i < indices.size(); i++) indices[i] = uint32_t(i);
  }
  for (size_t i = 0; i < indices.size(); i++)
    if (indices[i] >= mesh.positions.size())
      throw InputError("index " + std::to_string(i) + " is out of range: " + std::to_string(indices[i]) +
                       " of " + std::to_string(mesh.positions.size()) + " vertices");
  if (primitive.mode == TINYGLTF_MODE_POINTS)
    return primitive.indices < 0 ? mesh : pick_points(mesh, indices);
  mesh.triangles = list_triangles(indices, primitive.mode);
  drop_unused_vertices(mesh);
  return mesh;
}

}  // namespace

tinygltf::Model geometry_model(const Document& document) {
  std::string text = geometry_json(document).dump();
  if (text.size() > std::numeric_limits<unsigned>::max()) throw InputError("JSON is too large");
  tinygltf::TinyGLTF loader;
  tinygltf::Model model;
  std::string error, warning;
  if (!loader.LoadASCIIFromString(&model, &error, &warning, text.data(), unsigned(text.size()), "."))
    throw InputError("is not valid glTF: " + one_line(error));
  const Json* meshes = find(document.json, "meshes");
  bool same = model.meshes.size() == (meshes ? meshes->size() : 0);
  for (size_t i = 0; same && i < model.meshes.size(); i++)
    same = model.meshes[i].primitives.size() == (*meshes)[i]["primitives"].size();
  if (!same)
    throw InputError("is not valid glTF: " + one_line(error));  // tinygltf skips what it cannot parse
  return model;
}

Float3s read_float3(const Document& document, const tinygltf::Model& model, int index) {
  const tinygltf::Accessor& a = accessor_of(model, index);
  int type = a.componentType;
  bool integer = type == TINYGLTF_COMPONENT_TYPE_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
                 type == TINYGLTF_COMPONENT_TYPE_SHORT || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;
  if (a.type != TINYGLTF_TYPE_VEC3 || !(integer || type == TINYGLTF_COMPONENT_TYPE_FLOAT))
    throw InputError(accessor_name(index) + " holds no positions or normals: wrong type");
  return read_vectors<3>(document, model, index);
}

TriangleMesh read_primitive(const Document& document, const tinygltf::Model& model, size_t mesh,
                            size_t primitive) {
  const Json& json = document.json["meshes"][mesh]["primitives"][primitive];
  try {
    if (int64_t view = stream_view(json); view >= 0) {
      Span stream = view_bytes(document, size_t(view));
      return decode(stream.data, stream.size, document.decoding);
    }
    if (!is_triangles(json) && !is_points(json)) throw InputError("draws neither triangles nor points");
    if (std::string codec = foreign_codec(document, json); !codec.empty())
      throw InputError("is compressed with " + codec + ", which relief does not read");
    const tinygltf::Primitive& plain = model.meshes.at(mesh).primitives.at(primitive);
    if (json.contains("indices") && plain.indices < 0) throw InputError("has indices without a buffer view");
    return read_plain(document, model, plain);
  } catch (const InputError& e) {
    throw InputError(primitive_name(document, mesh, primitive) + ": " + e.what());
  }
}

std::string primitive_name(const Document& document, size_t mesh, size_t primitive) {
  const Json* name = find(document.json["meshes"][mesh], "name");
  std::string quoted = name && name->is_string() ? " '" + one_line(name->get<std::string>()) + "'" : "";
  return "mesh " + std::to_string(mesh) + quoted + " primitive " + std::to_string(primitive);
}

bool is_triangles(const Json& primitive) {
  uint64_t mode = primitive.value("mode", uint64_t(4));
  return mode >= 4 && mode <= 6;
}

bool is_points(const Json& primitive) { return primitive.value("mode", uint64_t(4)) == 0; }

std::string foreign_codec(const Document& document, const Json& primitive) {
  if (const Json* extensions = find(primitive, "extensions"))
    if (extensions->contains("KHR_draco_mesh_compression")) return "KHR_draco_mesh_compression";
  std::vector<const Json*> accessors;
  for (const Json& index : primitive.at("attributes")) accessors.push_back(&index);
  if (const Json* indices = find(primitive, "indices")) accessors.push_back(indices);
  for (const Json* index : accessors) {
    const Json* view = find(document.json["accessors"][index->get<size_t>()], "bufferView");
    if (!view) continue;
    const Json* extensions = find(document.json["bufferViews"][view->get<size_t>()], "extensions");
    for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
      if (extensions && extensions->contains(name)) return name;
  }
  return "";
}

}  // namespace relief
