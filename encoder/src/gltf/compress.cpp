// Compression of the primitives of a scene, the rest of which passes through.
#include <algorithm>
#include <map>
#include <set>

#include "gltf/accessors.h"
#include "gltf/compact.h"
#include "gltf/geometry.h"
#include "gltf/gltf.h"
#include "gltf/references.h"
#include "gltf/touching.h"

namespace relief {

namespace {

// About what a compressed primitive adds to the JSON: a buffer view, the extension, mostly an accessor of
// normals.
constexpr uint64_t kJsonBytes = 150;

struct Primitive {
  size_t mesh, number;
  PrimitiveReport report;
  std::string key;             // equal for primitives that draw the same elements of the same accessors
  std::vector<size_t> inputs;  // its accessors
  TriangleMesh geometry;       // if it is a candidate
  bool candidate() const { return report.reason.empty(); }
};

Json& json_of(Document& document, const Primitive& p) {
  return document.json["meshes"][p.mesh]["primitives"][p.number];
}

// Why a primitive cannot be coded, as far as its own JSON tells; empty if it can.
std::string obstacle(const Document& document, const Json& primitive, const std::string& unknown) {
  if (stream_view(primitive) >= 0) return "is compressed already";
  if (!is_triangles(primitive) && !is_points(primitive)) return "draws lines";
  if (std::string codec = foreign_codec(document, primitive); !codec.empty())
    return "is compressed with " + codec;
  for (const auto& [name, accessor] : primitive["attributes"].items())
    if (name != "POSITION" && name != "NORMAL" && name != "COLOR_0")
      return "has the attribute " + name + ", which is not coded yet";
  if (!primitive["attributes"].contains("POSITION")) return "has no POSITION";
  if (primitive.contains("targets")) return "has morph targets, which are not coded yet";
  if (const Json* extensions = find(primitive, "extensions"))
    for (const auto& [name, value] : extensions->items())
      if (name != "KHR_materials_variants") return "has the extension " + name;
  const Json* indices = find(primitive, "indices");
  if (indices && !document.json["accessors"][indices->get<size_t>()].contains("bufferView"))
    return "has indices without a buffer view";
  if (!unknown.empty()) return "is in a file in which " + unknown + " may refer to its accessors";
  return "";
}

std::vector<Primitive> list_primitives(Document& document) {
  std::vector<Primitive> list;
  std::string unknown = unknown_referrer(document.json);
  Json* meshes = find(document.json, "meshes");
  for (size_t m = 0; meshes && m < meshes->size(); m++) {
    for (size_t i = 0; i < (*meshes)[m]["primitives"].size(); i++) {
      Primitive p{m, i, {}, {}, {}, {}};
      const Json& json = json_of(document, p);
      p.report.name = primitive_name(document, m, i);
      p.report.reason = obstacle(document, json, unknown);
      p.key = json["attributes"].dump() + json.value("indices", Json()).dump() +
              json.value("mode", Json(4)).dump();
      for (const Json& accessor : json["attributes"]) p.inputs.push_back(accessor.get<size_t>());
      if (const Json* indices = find(json, "indices")) p.inputs.push_back(indices->get<size_t>());
      list.push_back(std::move(p));
    }
  }
  return list;
}

uint64_t component_bytes(const Json& accessor) {
  return uint64_t(tinygltf::GetComponentSizeInBytes(accessor["componentType"].get<uint32_t>()));
}

uint64_t element_bytes(const Json& accessor) {
  return component_bytes(accessor) * (accessor["type"] == "VEC4" ? 4 : 3);
}

// Bytes of a primitive's elements in one of its accessors: of the vertices that it uses, or of its indices.
uint64_t input_bytes(const Document& document, const Json& primitive, uint64_t vertices, size_t input) {
  const Json& accessor = document.json["accessors"][input];
  const Json* indices = find(primitive, "indices");
  if (indices && *indices == input) return component_bytes(accessor) * accessor["count"].get<uint64_t>();
  return element_bytes(accessor) * vertices;
}

void read_candidates(Document& document, const tinygltf::Model& model, std::vector<Primitive>& primitives) {
  for (Primitive& p : primitives) {
    if (!p.candidate()) continue;
    p.geometry = read_primitive(document, model, p.mesh, p.number);
    p.report.vertices = p.geometry.positions.size();
    p.report.triangles = p.geometry.triangles.size();
    if (p.geometry.triangles.empty() && !is_points(json_of(document, p)))
      p.report.reason = "has no triangles";
    for (const auto& color : p.geometry.colors)
      if (color[3] < 255) p.report.reason = "has colours that are not opaque";
    for (size_t input : p.inputs)
      p.report.bytes_before += input_bytes(document, json_of(document, p), p.report.vertices, input);
    if (p.candidate() && p.report.bytes_before <= kJsonBytes)
      p.report.reason = "would not shrink: " + std::to_string(p.report.bytes_before) + " bytes are too few";
  }
}

// Can a plain primitive's triangles be read at all?
bool is_readable(const Document& document, const Json& primitive) {
  const Json* indices = find(primitive, "indices");
  bool has_indices = !indices || document.json["accessors"][indices->get<size_t>()].contains("bufferView");
  return primitive["attributes"].contains("POSITION") && has_indices;
}

// Primitives of one mesh (begin to end) of which one could be coded: those that touch another pass through.
void find_touching(Document& document, const tinygltf::Model& model, Primitive* begin, Primitive* end) {
  std::vector<std::vector<std::array<float, 3>>> borders;
  std::string unreadable;
  for (Primitive* p = begin; p != end; p++) {
    borders.emplace_back();
    const Json& json = json_of(document, *p);
    if (!is_triangles(json)) continue;
    if (p->candidate()) {
      borders.back() = border_positions(p->geometry);
    } else if (std::string codec = foreign_codec(document, json); !codec.empty()) {
      unreadable = "shares its mesh with a primitive that is compressed with " + codec;
    } else if (stream_view(json) >= 0 || is_readable(document, json)) {
      borders.back() = border_positions(read_primitive(document, model, p->mesh, p->number));
    }
  }
  size_t count = size_t(end - begin);
  std::vector<std::string> reasons(count);
  for (size_t a = 0; a < count; a++)
    for (size_t b = 0; b < count && reasons[a].empty(); b++)
      if (a != b && have_common(borders[a], borders[b]))
        reasons[a] = "touches primitive " + std::to_string(b) + " of its mesh";
  for (size_t a = 0; a < count; a++)
    if (begin[a].candidate()) begin[a].report.reason = !unreadable.empty() ? unreadable : reasons[a];
}

void find_all_touching(Document& document, const tinygltf::Model& model, std::vector<Primitive>& primitives) {
  for (size_t i = 0, j = 0; i < primitives.size(); i = j) {
    bool any = false;
    for (; j < primitives.size() && primitives[j].mesh == primitives[i].mesh; j++)
      any = any || primitives[j].candidate();
    if (any && j - i > 1) find_touching(document, model, &primitives[i], &primitives[i] + (j - i));
  }
}

void encode_candidates(std::vector<Primitive>& primitives, const PrimitiveEncoder& encode_primitive) {
  std::map<std::string, Primitive*> first;
  uint64_t vertices = 0;
  for (Primitive& p : primitives)
    if (p.candidate() && first.try_emplace(p.key, &p).second) vertices += p.report.vertices;
  for (Primitive& p : primitives) {
    if (!p.candidate()) continue;
    Primitive* source = first[p.key];
    if (source == &p) {
      try {
        p.report.result = encode_primitive(p.geometry, double(p.report.vertices) / double(vertices));
        p.report.bytes_after = p.report.result.stream.size();
      } catch (const InputError& e) {
        p.report.reason = e.what();
      }
    } else {
      p.report.result = source->report.result;
      p.report.reason = source->report.reason;
      p.report.bytes_after = source->report.bytes_after;
    }
    p.geometry = {};
  }
}

// How often each accessor is referred to, in all and by the candidates.
struct Uses {
  size_t all = 0, candidates = 0;
};

std::vector<Uses> count_uses(Document& document, const std::vector<Primitive>& primitives) {
  std::vector<Uses> uses(document.json.contains("accessors") ? document.json["accessors"].size() : 0);
  for_each_reference(document.json, [&](const Reference& r) {
    if (r.to == Referred::kAccessor) uses[r.index->get<size_t>()].all++;
  });
  for (const Primitive& p : primitives)
    if (p.candidate())
      for (size_t input : p.inputs) uses[input].candidates++;
  return uses;
}

// A stream, with its JSON, must be smaller than the bytes that leave the file for it. Refusing one keeps its
// accessors in the file, and so may make another one not worth while: repeated until nothing changes.
void refuse_growing(Document& document, std::vector<Primitive>& primitives) {
  for (bool changed = true; changed;) {
    changed = false;
    std::vector<Uses> uses = count_uses(document, primitives);
    std::map<std::string, std::string> refused;
    for (Primitive& p : primitives) {
      if (!p.candidate()) continue;
      uint64_t freed = 0;
      for (size_t input : p.inputs)
        if (uses[input].all == uses[input].candidates)
          freed += input_bytes(document, json_of(document, p), p.report.vertices, input);
      if (p.report.bytes_after + kJsonBytes < freed) continue;
      changed = true;
      refused[p.key] = "would not shrink: " + std::to_string(freed) + " bytes, compressed " +
                       std::to_string(p.report.bytes_after);
    }
    for (Primitive& p : primitives)
      if (p.candidate() && refused.count(p.key)) p.report.reason = refused[p.key];
  }
}

// What compact() may leave out afterwards.
struct Released {
  std::set<size_t> accessors, views;
};

void release_views(const Json& accessor, Released& released) {
  if (const Json* view = find(accessor, "bufferView")) released.views.insert(view->get<size_t>());
  if (const Json* sparse = find(accessor, "sparse"))
    for (const char* part : {"indices", "values"})
      released.views.insert((*sparse)[part]["bufferView"].get<size_t>());
}

// Gives the primitive an accessor without data: its old one altered if nobody else uses it, so that its name
// and extras stay, else a new one. Returns its index.
size_t replace_accessor(Document& document, const Json* old, bool shared, const Json& fresh,
                        Released& released) {
  if (!old) return append(document.json, "accessors", fresh);
  size_t index = old->get<size_t>();
  if (shared) {
    released.accessors.insert(index);
    return append(document.json, "accessors", fresh);
  }
  Json& accessor = document.json["accessors"][index];
  release_views(accessor, released);
  for (const char* key : {"bufferView", "byteOffset", "normalized", "sparse", "min", "max"})
    accessor.erase(key);
  for (const auto& [key, value] : fresh.items()) accessor[key] = value;
  return index;
}

// Rewrites all primitives of one key; `same` is not empty.
void replace_primitives(Document& document, const std::vector<Primitive*>& same,
                        const std::vector<Uses>& uses, Released& released) {
  const Bytes& stream = same[0]->report.result.stream;
  TriangleMesh mesh = decode(stream.data(), stream.size());
  Json old = json_of(document, *same[0]);
  const bool points = is_points(old);
  auto replace = [&](const Json* index, const Json& fresh) {
    bool shared = index && uses[index->get<size_t>()].all != same.size();
    return replace_accessor(document, index, shared, fresh, released);
  };
  size_t position = replace(find(old["attributes"], "POSITION"), position_accessor(mesh));
  size_t normal = replace(find(old["attributes"], "NORMAL"), normal_accessor(mesh));
  const Json* old_color = find(old["attributes"], "COLOR_0");
  const bool colored = !mesh.colors.empty();
  size_t color = colored ? replace(old_color, color_accessor(mesh)) : 0;
  if (old_color && !colored) released.accessors.insert(old_color->get<size_t>());
  size_t indices = points ? 0 : replace(find(old, "indices"), index_accessor(mesh));
  if (const Json* unused = points ? find(old, "indices") : nullptr)
    released.accessors.insert(unused->get<size_t>());
  size_t view = append_view(document, stream);
  for (Primitive* p : same) {
    p->report.compressed = true;
    Json& json = json_of(document, *p);
    json["attributes"]["POSITION"] = position;
    json["attributes"]["NORMAL"] = normal;
    if (colored)
      json["attributes"]["COLOR_0"] = color;
    else
      json["attributes"].erase("COLOR_0");
    if (points) {
      json.erase("indices");
    } else {
      json["indices"] = indices;
      if (json.contains("mode")) json["mode"] = 4u;
    }
    json["extensions"][kExtension] = {{"bufferView", view}};
  }
}

bool replace_all(Document& document, std::vector<Primitive>& primitives) {
  std::vector<Uses> uses = count_uses(document, primitives);
  std::map<std::string, std::vector<Primitive*>> groups;
  std::vector<const std::string*> order;
  for (Primitive& p : primitives) {
    if (!p.candidate()) continue;
    auto& group = groups[p.key];
    if (group.empty()) order.push_back(&p.key);
    group.push_back(&p);
  }
  if (order.empty()) return false;
  Released released;
  for (const std::string* key : order) replace_primitives(document, groups[*key], uses, released);
  add_name(document.json, "extensionsUsed", kExtension);
  add_name(document.json, "extensionsRequired", kExtension);
  compact(document, released.accessors, released.views);
  return true;
}

}  // namespace

std::vector<PrimitiveReport> compress_gltf(const std::string& in, const std::string& out,
                                           const PrimitiveEncoder& encode_primitive) {
  Document document = load_document(in);
  tinygltf::Model model = geometry_model(document);
  std::vector<Primitive> primitives = list_primitives(document);
  read_candidates(document, model, primitives);
  find_all_touching(document, model, primitives);
  encode_candidates(primitives, encode_primitive);
  refuse_growing(document, primitives);
  bool changed = replace_all(document, primitives);
  if (!changed && document.buffers.size() > 1 && unknown_referrer(document.json).empty())
    compact(document, {}, {});  // makes one buffer
  save_document(std::move(document), out);
  std::vector<PrimitiveReport> reports;
  for (Primitive& p : primitives) {
    if (!p.report.compressed) p.report.result.stream.clear();
    reports.push_back(std::move(p.report));
  }
  return reports;
}

}  // namespace relief
