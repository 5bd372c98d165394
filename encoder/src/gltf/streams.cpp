#include <set>

#include "gltf/document.h"
#include "gltf/gltf.h"

namespace relief {

std::vector<std::vector<uint8_t>> read_streams(const std::string& path) {
  std::string extension = lower_extension(path);
  if (extension != ".glb" && extension != ".gltf") return {read_file(path)};
  Document document = load_document(path);
  std::vector<std::vector<uint8_t>> streams;
  std::set<int64_t> seen;
  const Json* meshes = find(document.json, "meshes");
  if (!meshes) return streams;
  for (const Json& mesh : *meshes)
    for (const Json& primitive : mesh["primitives"]) {
      int64_t view = stream_view(primitive);
      if (view < 0 || !seen.insert(view).second) continue;
      Span span = view_bytes(document, size_t(view));
      streams.emplace_back(span.data, span.data + span.size);
    }
  return streams;
}

}  // namespace relief
