#include "gltf/compact.h"

#include <algorithm>
#include <map>

#include "gltf/references.h"

namespace relief {

namespace {

uint64_t component_bytes(uint64_t type) {
  switch (type) {
    case 5120:
    case 5121:
      return 1;
    case 5122:
    case 5123:
      return 2;
    case 5125:
    case 5126:
      return 4;
    default:
      throw InputError("accessor has unknown componentType " + std::to_string(type));
  }
}

// Bytes of an element, with the padding of matrix columns to 4 bytes (glTF 2.0, 3.6.2.4).
uint64_t element_bytes(const Json& accessor) {
  static const std::map<std::string, std::pair<int, int>> shapes = {
      {"SCALAR", {1, 1}}, {"VEC2", {1, 2}}, {"VEC3", {1, 3}}, {"VEC4", {1, 4}},
      {"MAT2", {2, 2}},   {"MAT3", {3, 3}}, {"MAT4", {4, 4}}};
  auto shape = shapes.find(accessor["type"].get<std::string>());
  if (shape == shapes.end()) throw InputError("accessor has an unknown type");
  auto [columns, rows] = shape->second;
  uint64_t column = uint64_t(rows) * component_bytes(accessor["componentType"].get<uint64_t>());
  return columns == 1 ? column : uint64_t(columns) * ((column + 3) / 4 * 4);
}

struct Range {
  uint64_t begin, end;
  bool operator<(const Range& other) const { return begin < other.begin; }
};

// The bytes of its buffer that an accessor reads.
Range accessor_range(const Json& accessor, const Json& view, size_t index) {
  uint64_t start = view.value("byteOffset", uint64_t(0)), length = view["byteLength"].get<uint64_t>();
  uint64_t offset = accessor.value("byteOffset", uint64_t(0)), count = accessor["count"].get<uint64_t>();
  uint64_t size = element_bytes(accessor), stride = view.value("byteStride", size);
  bool fits = count > 0 && stride > 0 && offset <= length && size <= length - offset &&
              count - 1 <= (length - offset - size) / stride;
  if (!fits) throw InputError("accessor " + std::to_string(index) + " exceeds its buffer view");
  return {start + offset, start + offset + stride * (count - 1) + size};
}

// Removes the items for which gone[i], and returns the new index of each of the others.
std::vector<size_t> remove_items(Json& root, const char* array, const std::vector<bool>& gone) {
  std::vector<size_t> renumbered(gone.size());
  Json kept = Json::array();
  for (size_t i = 0; i < gone.size(); i++) {
    renumbered[i] = kept.size();
    if (!gone[i]) kept.push_back(std::move(root[array][i]));
  }
  if (gone.empty()) return renumbered;
  if (kept.empty())
    root.erase(array);
  else
    root[array] = std::move(kept);
  return renumbered;
}

void renumber(Json& root, Referred what, const std::vector<size_t>& renumbered) {
  for_each_reference(root, [&](const Reference& r) {
    if (r.to == what) *r.index = renumbered.at(r.index->get<size_t>());
  });
}

std::vector<bool> unreferenced(Json& root, Referred what, const char* array,
                               const std::set<size_t>& candidates) {
  std::vector<bool> gone(root.contains(array) ? root[array].size() : 0);
  for (size_t i : candidates) gone.at(i) = true;
  for_each_reference(root, [&](const Reference& r) {
    if (r.to == what) gone.at(r.index->get<size_t>()) = false;
  });
  return gone;
}

// The bytes that stay, as disjoint ranges of the old buffers in order, and where they go in the new one.
class Packing {
 public:
  explicit Packing(size_t buffers) : ranges_(buffers) {}

  void keep(size_t buffer, Range range) {
    // A range keeps its place modulo 4, and starts at a multiple of 4 so that offsets in a view stay aligned.
    range.begin = range.begin / 4 * 4;
    ranges_[buffer].push_back(range);
  }

  Bytes pack(const std::vector<Bytes>& buffers) {
    Bytes packed;
    for (size_t b = 0; b < buffers.size(); b++) {
      merge(ranges_[b]);
      for (const Range& range : ranges_[b]) {
        packed.resize((packed.size() + 3) / 4 * 4);
        targets_.resize(b + 1);
        targets_[b].push_back(packed.size());
        packed.insert(packed.end(), buffers[b].begin() + ptrdiff_t(range.begin),
                      buffers[b].begin() + ptrdiff_t(range.end));
      }
    }
    targets_.resize(buffers.size());
    return packed;
  }

  // Where a kept byte of a buffer went.
  uint64_t moved(size_t buffer, uint64_t offset) const {
    const std::vector<Range>& ranges = ranges_[buffer];
    auto after = std::upper_bound(ranges.begin(), ranges.end(), Range{offset, offset});
    size_t i = size_t(after - ranges.begin()) - 1;
    return targets_[buffer][i] + (offset - ranges[i].begin);
  }

 private:
  static void merge(std::vector<Range>& ranges) {
    std::sort(ranges.begin(), ranges.end());
    std::vector<Range> merged;
    for (const Range& range : ranges) {
      if (!merged.empty() && range.begin <= merged.back().end)
        merged.back().end = std::max(merged.back().end, range.end);
      else
        merged.push_back(range);
    }
    ranges = std::move(merged);
  }
  std::vector<std::vector<Range>> ranges_;
  std::vector<std::vector<uint64_t>> targets_;
};

struct View {
  Range old_range{};     // in its buffer
  bool shrinks = false;  // lost an accessor, and only accessors refer to it: just their bytes stay
  Range kept{};          // what stays
  std::vector<size_t> accessors;
};

std::vector<View> list_views(Document& document, const std::set<size_t>& touched) {
  Json& root = document.json;
  std::vector<View> views(root.contains("bufferViews") ? root["bufferViews"].size() : 0);
  for (size_t v = 0; v < views.size(); v++) {
    const Json& view = root["bufferViews"][v];
    uint64_t begin = view.value("byteOffset", uint64_t(0));
    views[v].old_range = {begin, begin + view["byteLength"].get<uint64_t>()};
    views[v].shrinks = touched.count(v) && !view.contains("extensions");
  }
  for_each_reference(root, [&](const Reference& r) {
    if (r.to != Referred::kView) return;
    View& view = views.at(r.index->get<size_t>());
    if (r.role == Role::kAccessorData)
      view.accessors.push_back(r.owner);
    else
      view.shrinks = false;
  });
  return views;
}

void keep_views(Document& document, std::vector<View>& views, Packing& packing) {
  for (size_t v = 0; v < views.size(); v++) {
    Json& json = document.json["bufferViews"][v];
    size_t buffer = json["buffer"].get<size_t>();
    for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
      const Json* extensions = find(json, "extensions");
      const Json* codec = extensions ? find(*extensions, name) : nullptr;
      if (!codec) continue;
      uint64_t begin = codec->value("byteOffset", uint64_t(0)),
               length = codec->value("byteLength", uint64_t(0));
      size_t source = codec->at("buffer").get<size_t>();
      uint64_t size = document.buffers[source].size();
      if (begin > size || length > size - begin) throw InputError("meshopt data exceeds its buffer");
      packing.keep(source, {begin, begin + length});
    }
    if (document.buffers[buffer].empty()) continue;  // a placeholder
    view_bytes(document, v);                         // throws if it exceeds the buffer
    View& view = views[v];
    view.kept = view.old_range;
    if (view.shrinks) {
      view.kept = {UINT64_MAX, 0};
      for (size_t a : view.accessors) {
        Range range = accessor_range(document.json["accessors"][a], json, a);
        range.begin = std::max(range.begin / 4 * 4, view.old_range.begin);
        view.kept = {std::min(view.kept.begin, range.begin), std::max(view.kept.end, range.end)};
        packing.keep(buffer, range);
      }
    } else {
      packing.keep(buffer, view.kept);
    }
  }
}

void move_views(Document& document, const std::vector<View>& views, const Packing& packing) {
  Json& root = document.json;
  for (size_t v = 0; v < views.size(); v++) {
    Json& json = root["bufferViews"][v];
    size_t buffer = json["buffer"].get<size_t>();
    if (Json* extensions = find(json, "extensions"))
      for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
        if (Json* codec = find(*extensions, name))
          (*codec)["byteOffset"] =
              packing.moved(codec->at("buffer").get<size_t>(), codec->value("byteOffset", uint64_t(0)));
    if (document.buffers[buffer].empty()) continue;
    const View& view = views[v];
    uint64_t begin = packing.moved(buffer, view.kept.begin);
    uint64_t end = packing.moved(buffer, view.kept.end - 1) + 1;
    for (size_t a : view.accessors) {
      Json& accessor = root["accessors"][a];
      uint64_t offset = view.old_range.begin + accessor.value("byteOffset", uint64_t(0));
      uint64_t moved = view.shrinks ? packing.moved(buffer, offset) - begin : offset - view.old_range.begin;
      if (moved != 0 || accessor.contains("byteOffset")) accessor["byteOffset"] = moved;
    }
    if (begin != 0 || json.contains("byteOffset")) json["byteOffset"] = begin;
    json["byteLength"] = end - begin;
  }
}

// One buffer with all data first, then the placeholders.
void merge_buffers(Document& document, Bytes packed) {
  Json& root = document.json;
  std::vector<size_t> renumbered(document.buffers.size());
  Json buffers = Json::array();
  std::vector<Bytes> bytes;
  Json first = {{"byteLength", packed.size()}};
  if (!packed.empty()) {
    for (size_t b = document.buffers.size(); b-- > 0;)
      if (!document.buffers[b].empty()) first = root["buffers"][b];
    first.erase("uri");
    first["byteLength"] = packed.size();
    buffers.push_back(std::move(first));
    bytes.push_back(std::move(packed));
  }
  for (size_t b = 0; b < document.buffers.size(); b++) {
    if (!document.buffers[b].empty()) continue;
    renumbered[b] = buffers.size();
    buffers.push_back(root["buffers"][b]);
    bytes.emplace_back();
  }
  renumber(root, Referred::kBuffer, renumbered);
  if (buffers.empty())
    root.erase("buffers");
  else
    root["buffers"] = std::move(buffers);
  document.buffers = std::move(bytes);
}

}  // namespace

void compact(Document& document, const std::set<size_t>& released, const std::set<size_t>& released_views) {
  Json& root = document.json;
  std::vector<bool> gone = unreferenced(root, Referred::kAccessor, "accessors", released);
  std::set<size_t> touched = released_views;
  for (size_t a = 0; a < gone.size(); a++) {
    if (!gone[a]) continue;
    const Json& accessor = root["accessors"][a];
    if (const Json* view = find(accessor, "bufferView")) touched.insert(view->get<size_t>());
    if (const Json* sparse = find(accessor, "sparse"))
      for (const char* part : {"indices", "values"})
        touched.insert((*sparse)[part]["bufferView"].get<size_t>());
  }
  renumber(root, Referred::kAccessor, remove_items(root, "accessors", gone));
  gone = unreferenced(root, Referred::kView, "bufferViews", touched);
  std::set<size_t> shrunk;
  std::vector<size_t> renumbered = remove_items(root, "bufferViews", gone);
  for (size_t v : touched)
    if (!gone[v]) shrunk.insert(renumbered[v]);
  renumber(root, Referred::kView, renumbered);

  std::vector<View> views = list_views(document, shrunk);
  Packing packing(document.buffers.size());
  bool keep_all = released.empty() && touched.empty();
  for (size_t b = 0; keep_all && b < document.buffers.size(); b++)
    packing.keep(b, {0, document.buffers[b].size()});
  keep_views(document, views, packing);
  Bytes packed = packing.pack(document.buffers);
  move_views(document, views, packing);
  merge_buffers(document, std::move(packed));
}

}  // namespace relief
