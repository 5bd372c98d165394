// Any bytes at all as a .glb or .gltf: read as a mesh, streams listed, and the scene passed through by
// compress_gltf and decompress_gltf, whose output must be readable.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "gltf/gltf.h"
#include "gltf/read_mesh.h"
#include "gltf_scenes.h"
#include "target.h"

namespace relief {
namespace {

std::string text_of(const TestBytes& bytes) { return {bytes.begin(), bytes.end()}; }

// A strip, a sparse accessor, transformations, short indices and normals.
std::string plain_scene() {
  SceneBuilder scene;
  TriangleMesh square;
  square.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0.5f}};
  square.triangles = {{0, 1, 2}, {2, 1, 3}};
  TestJson strip = scene.primitive(square), fan = strip, shorts = strip;
  strip["mode"] = 5, fan["mode"] = 6;
  strip.erase("indices");
  const size_t indices = scene.view(to_bytes(std::vector<uint16_t>{0, 1, 2, 2, 1, 3}), 34963);
  shorts["indices"] = scene.accessor(6, "SCALAR", 5123, {{"bufferView", indices}});
  const std::vector<std::array<float, 3>> up(4, {0, 0, 1});
  shorts["attributes"]["NORMAL"] =
      scene.accessor(4, "VEC3", 5126, {{"bufferView", scene.view(to_bytes(up))}});
  TestJson sparse = SceneBuilder::bounds(square.positions);
  sparse["sparse"] = {{"count", 1},
                      {"indices", {{"bufferView", scene.view({3})}, {"componentType", 5121}}},
                      {"values", {{"bufferView", scene.view(to_bytes(std::vector<float>{1, 1, 1}))}}}};
  TestJson zeros = shorts;
  zeros["attributes"] = {{"POSITION", scene.accessor(4, "VEC3", 5126, sparse)}};
  scene.mesh({strip, fan}, "strip");
  scene.mesh({shorts, zeros}, "shorts");
  scene.json["nodes"][0]["scale"] = {1, 2, 3};
  scene.json["nodes"][0]["rotation"] = {0, 0, 1, 0};
  scene.json["nodes"][1]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1};
  return text_of(scene.glb());
}

// A compressed primitive: the smallest of the golden streams.
std::string compressed_scene() {
  SceneBuilder scene;
  const TestBytes stream = read_bytes(RELIEF_SOURCE_DIR "/tests/golden/one-patch.relief");
  const TriangleMesh mesh = decode(stream.data(), stream.size());
  const size_t view = scene.view(stream);
  const size_t position =
      scene.accessor(mesh.positions.size(), "VEC3", 5126, SceneBuilder::bounds(mesh.positions));
  const size_t indices = scene.accessor(3 * mesh.triangles.size(), "SCALAR", 5125, TestJson::object());
  scene.mesh({{{"attributes", {{"POSITION", position}}},
               {"indices", indices},
               {"extensions", {{"RELIEF_patch_compression", {{"bufferView", view}}}}}}});
  scene.json["extensionsUsed"] = scene.json["extensionsRequired"] = {"RELIEF_patch_compression"};
  return text_of(scene.glb());
}

const char* text_scene() {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"children":[1],"translation":[1,2,3]},{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
"textures":[{"source":0}],"images":[{"uri":"data:image/png;base64,iVBORw0KGgo="}],
"buffers":[{"byteLength":42,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA"}],
"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}]})";
}

// One line that says what is wrong, or the program ends.
template <class Work>
bool succeeds(Work work) {
  try {
    work();
    return true;
  } catch (const InputError& e) {
    if (std::string(e.what()).find('\n') == std::string::npos) return false;
    std::fprintf(stderr, "the message is not one line: %s\n", e.what());
    std::abort();
  }
}

void require(bool good, const char* what) {
  if (good) return;
  std::fprintf(stderr, "%s\n", what);
  std::abort();
}

}  // namespace

std::vector<std::string> seeds() { return {plain_scene(), compressed_scene(), text_scene()}; }

bool accepts(const uint8_t* data, size_t size) {
  static const TemporaryFolder folder;
  const std::string in = folder / "in.gltf", out = folder / "out.glb";
  write_bytes(in, TestBytes(data, data + size));
  const bool read = succeeds([&] {
    const TriangleMesh mesh = read_gltf_mesh(in);
    for (const auto& t : mesh.triangles)
      for (uint32_t i : t) require(i < mesh.positions.size(), "an index is out of range");
  });
  succeeds([&] { read_streams(in); });
  const PrimitiveEncoder refuse = [](const TriangleMesh&, double) -> EncodeResult {
    throw InputError("not now");
  };
  if (succeeds([&] { compress_gltf(in, out, refuse); }) && read)
    require(succeeds([&] { read_gltf_mesh(out); }), "what passed through cannot be read");
  if (succeeds([&] { decompress_gltf(in, out); }) && read)
    require(succeeds([&] { read_gltf_mesh(out); }), "what was decompressed cannot be read");
  return read;
}

}  // namespace relief
