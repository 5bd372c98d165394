// Building glTF scenes for the tests, with a GLB writer of their own.
#pragma once
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "shapes.h"

namespace relief {

using TestJson = nlohmann::ordered_json;
using TestBytes = std::vector<uint8_t>;

// A folder that is gone at the end of the test.
struct TemporaryFolder {
  std::filesystem::path path;
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "relief-XXXXXX").string();
    path = mkdtemp(pattern.data());
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  std::string operator/(const std::string& name) const { return (path / name).string(); }
  std::vector<std::string> names() const {
    std::vector<std::string> list;
    for (const auto& entry : std::filesystem::directory_iterator(path))
      list.push_back(entry.path().filename().string());
    std::sort(list.begin(), list.end());
    return list;
  }
};

inline void write_bytes(const std::string& path, const TestBytes& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
}

inline void write_text(const std::string& path, const std::string& text) {
  write_bytes(path, TestBytes(text.begin(), text.end()));
}

inline TestBytes read_bytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return TestBytes(std::istreambuf_iterator<char>(in), {});
}

// Khronos' validator looks at these files later (web/test/validator.test.mjs).
inline void keep_for_validator(const std::string& glb, const std::string& name) {
  std::filesystem::path folder = std::filesystem::path(RELIEF_SOURCE_DIR) / "build/test-outputs";
  std::filesystem::create_directories(folder);
  std::filesystem::copy_file(glb, folder / name, std::filesystem::copy_options::overwrite_existing);
}

template <typename T>
TestBytes to_bytes(const std::vector<T>& values) {
  TestBytes bytes(values.size() * sizeof(T));
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

inline TestBytes make_glb(const TestJson& json, const TestBytes& binary) {
  std::string text = json.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  TestBytes data = binary, file;
  data.resize((data.size() + 3) / 4 * 4);
  auto word = [&](uint32_t v) {
    for (int k = 0; k < 4; k++) file.push_back(uint8_t(v >> (8 * k)));
  };
  word(0x46546C67), word(2), word(uint32_t(12 + 8 + text.size() + 8 + data.size()));
  word(uint32_t(text.size())), word(0x4E4F534A);
  file.insert(file.end(), text.begin(), text.end());
  word(uint32_t(data.size())), word(0x004E4942);
  file.insert(file.end(), data.begin(), data.end());
  return file;
}

struct Glb {
  TestJson json;
  TestBytes binary;
  // The bytes of a buffer view.
  TestBytes view(size_t i) const {
    const TestJson& v = json["bufferViews"][i];
    auto begin = binary.begin() + v.value("byteOffset", 0);
    return TestBytes(begin, begin + v["byteLength"].get<int>());
  }
};

inline Glb read_glb(const std::string& path) {
  TestBytes file = read_bytes(path);
  uint32_t json_size, binary_size = 0;
  std::memcpy(&json_size, &file.at(12), 4);
  Glb glb;
  glb.json = TestJson::parse(file.begin() + 20, file.begin() + 20 + json_size);
  size_t at = 20 + json_size;
  if (file.size() >= at + 8) {
    std::memcpy(&binary_size, &file.at(at), 4);
    glb.binary.assign(file.begin() + ptrdiff_t(at) + 8, file.begin() + ptrdiff_t(at) + 8 + binary_size);
  }
  return glb;
}

// A scene under construction: one buffer, one scene, a node a mesh.
struct SceneBuilder {
  TestJson json = {{"asset", {{"version", "2.0"}}}, {"scene", 0}};
  TestBytes binary;

  SceneBuilder() { json["scenes"] = TestJson::parse(R"([{"nodes": []}])"); }

  size_t view(const TestBytes& bytes, int target = 0) {
    binary.resize((binary.size() + 3) / 4 * 4);
    TestJson v = {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}};
    if (target) v["target"] = target;
    binary.insert(binary.end(), bytes.begin(), bytes.end());
    json["bufferViews"].push_back(v);
    return json["bufferViews"].size() - 1;
  }
  size_t accessor(size_t count, const char* type, int component, const TestJson& more) {
    TestJson a = {{"componentType", component}, {"count", count}, {"type", type}};
    a.update(more);
    json["accessors"].push_back(a);
    return json["accessors"].size() - 1;
  }
  static TestJson bounds(const std::vector<std::array<float, 3>>& positions) {
    std::array<float, 3> low = positions.at(0), high = low;
    for (const auto& p : positions)
      for (size_t k = 0; k < 3; k++) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
    return {{"min", low}, {"max", high}};
  }
  size_t positions(const std::vector<std::array<float, 3>>& list) {
    TestJson more = bounds(list);
    more["bufferView"] = view(to_bytes(list), 34962);
    return accessor(list.size(), "VEC3", 5126, more);
  }
  size_t indices(const std::vector<std::array<uint32_t, 3>>& list) {
    return accessor(3 * list.size(), "SCALAR", 5125, {{"bufferView", view(to_bytes(list), 34963)}});
  }
  TestJson primitive(const TriangleMesh& mesh) {
    size_t p = positions(mesh.positions), i = indices(mesh.triangles);
    return {{"attributes", {{"POSITION", p}}}, {"indices", i}};
  }
  // Of COLOR_0: linear.
  size_t colors(const std::vector<std::array<uint8_t, 4>>& list) {
    return accessor(list.size(), "VEC4", 5121,
                    {{"bufferView", view(to_bytes(list), 34962)}, {"normalized", true}});
  }
  // A mesh of these primitives and a node in the scene that draws it; returns the mesh.
  size_t mesh(const std::vector<TestJson>& primitives, const std::string& name = "") {
    TestJson m = {{"primitives", primitives}};
    if (!name.empty()) m["name"] = name;
    json["meshes"].push_back(m);
    node({{"mesh", json["meshes"].size() - 1}});
    return json["meshes"].size() - 1;
  }
  size_t node(const TestJson& n) {
    json["nodes"].push_back(n);
    json["scenes"][0]["nodes"].push_back(json["nodes"].size() - 1);
    return json["nodes"].size() - 1;
  }
  TestBytes glb() {
    json["buffers"] = TestJson::parse("[{}]");
    json["buffers"][0]["byteLength"] = binary.size();
    return make_glb(json, binary);
  }
  std::string save(const std::string& path) {
    write_bytes(path, glb());
    return path;
  }
};

}  // namespace relief
