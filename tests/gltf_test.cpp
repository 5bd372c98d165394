#include "gltf/gltf.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "gltf/read_mesh.h"
#include "gltf_scenes.h"
#include "relief/relief.h"

namespace relief {
namespace {

// The stream that the tests' encoder returns for whatever it is given: a real one, made once.
const std::vector<uint8_t>& sphere_stream() {
  static const std::vector<uint8_t> stream = [] {
    EncodeOptions options;
    options.error = 2e-3;
    return encode(make_bumpy_sphere(4), options).stream;
  }();
  return stream;
}

struct FakeEncoder {
  int calls = 0;
  std::vector<double> shares;
  std::vector<size_t> vertices;
  PrimitiveEncoder function() {
    return [this](const TriangleMesh& mesh, double share) {
      calls++;
      shares.push_back(share);
      vertices.push_back(mesh.positions.size());
      EncodeResult result;
      result.stream = sphere_stream();
      result.target_met = true;
      return result;
    };
  }
};

std::vector<PrimitiveReport> compress(const std::string& in, const std::string& out) {
  FakeEncoder encoder;
  return compress_gltf(in, out, encoder.function());
}

// For scenes that are valid: Khronos' validator is to find that they still are.
void keep(const std::string& glb) {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  keep_for_validator(glb, std::string("gltf-") + test->test_suite_name() + "-" + test->name() + ".glb");
}

TriangleMesh decoded_sphere() { return decode(sphere_stream().data(), sphere_stream().size()); }

void expect_equal(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.triangles, b.triangles);
}

double signed_volume(const TriangleMesh& mesh) {
  double volume = 0;
  for (const auto& t : mesh.triangles) {
    const auto &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    volume += (double(a[0]) * (double(b[1]) * c[2] - double(b[2]) * c[1]) +
               double(a[1]) * (double(b[2]) * c[0] - double(b[0]) * c[2]) +
               double(a[2]) * (double(b[0]) * c[1] - double(b[1]) * c[0])) /
              6;
  }
  return volume;
}

// The corners of all triangles in order, so that meshes with other vertex numbers can be compared.
std::vector<std::array<float, 3>> corners(const TriangleMesh& mesh) {
  std::vector<std::array<float, 3>> list;
  for (const auto& t : mesh.triangles)
    for (uint32_t v : t) list.push_back(mesh.positions[v]);
  return list;
}

std::string error_of(const std::function<void()>& f) {
  try {
    f();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

const TestJson& extension_of(const TestJson& json, size_t mesh, size_t primitive) {
  static const TestJson none;
  const TestJson& p = json["meshes"][mesh]["primitives"][primitive];
  if (!p.contains("extensions") || !p["extensions"].contains("RELIEF_patch_compression")) return none;
  return p["extensions"]["RELIEF_patch_compression"];
}

// --- A stream as a scene
// -------------------------------------------------------------------------------------------

TEST(StreamScene, HoldsTheStreamAndWhatItDecodesTo) {
  TemporaryFolder folder;
  TriangleMesh sphere = decoded_sphere();
  for (const char* name : {"s.glb", "s.gltf"}) {
    write_stream_gltf(folder / name, sphere_stream());
    ASSERT_EQ(read_streams(folder / name).size(), 1u);
    EXPECT_EQ(read_streams(folder / name)[0], sphere_stream());
    TriangleMesh mesh = read_gltf_mesh(folder / name);
    expect_equal(mesh, sphere);
    EXPECT_EQ(mesh.normals.size(), mesh.positions.size());
  }
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"s.bin", "s.glb", "s.gltf"}));
}

TEST(StreamScene, AccessorsPromiseWhatTheDecoderGives) {
  TemporaryFolder folder;
  write_stream_gltf(folder / "s.glb", sphere_stream());
  keep(folder / "s.glb");
  TestJson json = read_glb(folder / "s.glb").json;
  relief_info info;
  ASSERT_EQ(relief_inspect(sphere_stream().data(), sphere_stream().size(), nullptr, &info), RELIEF_OK);
  const TestJson& primitive = json["meshes"][0]["primitives"][0];
  const TestJson& position = json["accessors"][primitive["attributes"]["POSITION"].get<int>()];
  const TestJson& normal = json["accessors"][primitive["attributes"]["NORMAL"].get<int>()];
  const TestJson& indices = json["accessors"][primitive["indices"].get<int>()];
  EXPECT_EQ(position["count"], info.vertex_count);
  EXPECT_EQ(normal["count"], info.vertex_count);
  EXPECT_EQ(indices["count"], 3 * info.triangle_count);
  TestJson bounds = SceneBuilder::bounds(decoded_sphere().positions);
  EXPECT_EQ(position["min"].get<std::vector<float>>(), bounds["min"].get<std::vector<float>>());
  EXPECT_EQ(position["max"].get<std::vector<float>>(), bounds["max"].get<std::vector<float>>());
  for (const TestJson& accessor : json["accessors"]) {
    EXPECT_FALSE(accessor.contains("bufferView"));
    EXPECT_FALSE(accessor.contains("byteOffset"));
  }
  EXPECT_EQ(json["extensionsRequired"], TestJson({"RELIEF_patch_compression"}));
  EXPECT_EQ(json["extensionsUsed"], TestJson({"RELIEF_patch_compression"}));
}

TEST(StreamScene, MayDrawPoints) {
  TemporaryFolder folder;
  write_stream_gltf(folder / "s.glb", sphere_stream(), true);
  keep(folder / "s.glb");
  const TestJson json = read_glb(folder / "s.glb").json;
  const TestJson& primitive = json["meshes"][0]["primitives"][0];
  EXPECT_EQ(primitive["mode"], 0);
  EXPECT_FALSE(primitive.contains("indices"));
  EXPECT_EQ(json["accessors"].size(), 2u);
  expect_equal(read_gltf_mesh(folder / "s.glb"), decoded_sphere());  // the surface
  EXPECT_EQ(decompress_gltf(folder / "s.glb", folder / "mesh.glb"), 1u);
  expect_equal(read_gltf_mesh(folder / "mesh.glb"), decoded_sphere());
  keep(folder / "mesh.glb");
  EXPECT_EQ(decompress_gltf(folder / "s.glb", folder / "points.glb", {.points = true}), 1u);
  keep(folder / "points.glb");
  EXPECT_EQ(read_glb(folder / "points.glb").json["meshes"][0]["primitives"][0]["mode"], 0);
  const TriangleMesh points = read_gltf_mesh(folder / "points.glb");
  EXPECT_TRUE(points.triangles.empty());
  EXPECT_EQ(points.positions,
            decode(sphere_stream().data(), sphere_stream().size(), {.points = true}).positions);
  EXPECT_EQ(points.normals.size(), points.positions.size());
}

TEST(StreamScene, DecompressesToTheSameMesh) {
  TemporaryFolder folder;
  write_stream_gltf(folder / "s.glb", sphere_stream());
  for (const char* name : {"plain.glb", "plain.gltf"}) {
    EXPECT_EQ(decompress_gltf(folder / "s.glb", folder / name), 1u);
    expect_equal(read_gltf_mesh(folder / name), decoded_sphere());
    EXPECT_TRUE(read_streams(folder / name).empty());
  }
  keep(folder / "plain.glb");
  TestJson json = read_glb(folder / "plain.glb").json;
  EXPECT_FALSE(json.contains("extensionsUsed"));
  EXPECT_FALSE(json.contains("extensionsRequired"));
  EXPECT_FALSE(json["meshes"][0]["primitives"][0].contains("extensions"));
  EXPECT_EQ(json["bufferViews"].size(), 3u);  // the stream's is gone
}

TEST(MeshScene, RoundTripsWithColours) {
  TemporaryFolder folder;
  TriangleMesh torus = make_torus(12, 8);
  for (size_t i = 0; i < torus.positions.size(); i++)
    torus.colors.push_back({uint8_t(3 * i), uint8_t(255 - i), uint8_t(i / 2), 255});
  write_mesh_gltf(folder / "m.glb", torus);
  keep(folder / "m.glb");
  expect_equal(read_gltf_mesh(folder / "m.glb"), torus);
  EXPECT_EQ(read_gltf_mesh(folder / "m.glb").colors, torus.colors);
  TestJson json = read_glb(folder / "m.glb").json;
  EXPECT_TRUE(json["meshes"][0]["primitives"][0]["attributes"].contains("COLOR_0"));
}

// --- What passes through
// -------------------------------------------------------------------------------------------

// A scene with a bit of everything around a mesh "statue" that can be compressed, drawn by two nodes.
SceneBuilder rich_scene() {
  SceneBuilder scene;
  TriangleMesh sphere = make_bumpy_sphere(4);
  TestJson statue = scene.primitive(sphere);
  statue["material"] = 1;
  statue["extras"] = {{"artist", "nobody"}};
  TriangleMesh box = make_cube(2);
  TestJson textured = scene.primitive(box);
  size_t uv = scene.view(TestBytes(box.positions.size() * 8, 7), 34962);
  textured["attributes"]["TEXCOORD_0"] =
      scene.accessor(box.positions.size(), "VEC2", 5126, {{"bufferView", uv}});
  textured["material"] = 0;
  scene.mesh({textured}, "box");
  scene.mesh({statue}, "statue");
  scene.json["nodes"][1]["scale"] = {2.0, 2.0, 2.0};
  scene.node({{"mesh", 1}, {"name", "mirror image"}, {"scale", {-1.5, 1, 1}}});
  size_t image = scene.view({0x89, 'P', 'N', 'G', 1, 2, 3, 4, 5});
  scene.json["images"] = TestJson::parse(R"([{"mimeType": "image/png"}])");
  scene.json["images"][0]["bufferView"] = image;
  scene.json["textures"] = TestJson::parse(R"([{"source": 0}])");
  scene.json["materials"] = TestJson::parse(R"([
      {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
      {"name": "stone", "extras": {"hardness": 6.5}, "extensions": {"KHR_materials_unlit": {}}}])");
  size_t times = scene.accessor(
      2, "SCALAR", 5126,
      {{"bufferView", scene.view(to_bytes(std::vector<float>{0, 1}))}, {"min", {0.0}}, {"max", {1.0}}});
  size_t moves = scene.accessor(2, "VEC3", 5126,
                                {{"bufferView", scene.view(to_bytes(std::vector<float>{0, 0, 0, 1, 2, 3}))}});
  TestJson channel = {{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}};
  TestJson sampler = {{"input", times}, {"output", moves}};
  scene.json["animations"].push_back(
      {{"channels", TestJson::array({channel})}, {"samplers", TestJson::array({sampler})}});
  scene.json["cameras"] =
      TestJson::parse(R"([{"type": "perspective", "perspective": {"yfov": 0.1, "znear": 1e-3}}])");
  scene.node({{"camera", 0}});
  scene.json["extensionsUsed"] = {"KHR_materials_unlit"};
  scene.json["extras"] = {{"note", "kept"}};
  return scene;
}

TEST(Compress, KeepsTheRestOfTheScene) {
  TemporaryFolder folder;
  SceneBuilder scene = rich_scene();
  std::string in = scene.save(folder / "in.glb"), out = folder / "out.glb";
  auto reports = compress(in, out);
  ASSERT_EQ(reports.size(), 2u);
  keep(out);
  EXPECT_FALSE(reports[0].compressed);
  EXPECT_NE(reports[0].reason.find("TEXCOORD_0"), std::string::npos);
  EXPECT_TRUE(reports[1].compressed);
  EXPECT_EQ(reports[1].name, "mesh 1 'statue' primitive 0");

  Glb before = read_glb(in), after = read_glb(out);
  for (const char* key : {"asset", "scene", "scenes", "nodes", "materials", "textures", "cameras", "extras"})
    EXPECT_EQ(before.json[key], after.json[key]) << key;
  EXPECT_EQ(after.json["meshes"][1]["name"], "statue");
  EXPECT_EQ(after.json["meshes"][1]["primitives"][0]["material"], 1);
  EXPECT_EQ(after.json["meshes"][1]["primitives"][0]["extras"], TestJson({{"artist", "nobody"}}));
  EXPECT_EQ(after.json["extensionsUsed"], TestJson({"KHR_materials_unlit", "RELIEF_patch_compression"}));
  auto image = [](const Glb& glb) { return glb.view(glb.json["images"][0]["bufferView"].get<size_t>()); };
  EXPECT_EQ(image(before), image(after));
  auto data = [](const Glb& glb, size_t accessor) {
    return glb.view(glb.json["accessors"][accessor]["bufferView"].get<size_t>());
  };
  for (const char* end : {"input", "output"})
    EXPECT_EQ(data(before, before.json["animations"][0]["samplers"][0][end].get<size_t>()),
              data(after, after.json["animations"][0]["samplers"][0][end].get<size_t>()));
  for (const char* name : {"POSITION", "TEXCOORD_0"})
    EXPECT_EQ(data(before, before.json["meshes"][0]["primitives"][0]["attributes"][name].get<size_t>()),
              data(after, after.json["meshes"][0]["primitives"][0]["attributes"][name].get<size_t>()));
}

TEST(Compress, RemovesTheBytesThatItReplaces) {
  TemporaryFolder folder;
  std::string in = rich_scene().save(folder / "in.glb"), out = folder / "out.glb";
  auto reports = compress(in, out);
  Glb before = read_glb(in), after = read_glb(out);
  EXPECT_EQ(after.json["bufferViews"].size(), before.json["bufferViews"].size() - 2 + 1);
  EXPECT_EQ(after.json["accessors"].size(), before.json["accessors"].size() + 1);  // NORMAL
  size_t expected = before.binary.size() - reports[1].bytes_before + reports[1].bytes_after;
  EXPECT_LE(after.binary.size(), expected + 8);  // alignment
  EXPECT_GE(after.binary.size() + 8, expected);
}

TEST(Compress, WritesGltfWithOneBufferBesideIt) {
  TemporaryFolder folder;
  std::string in = rich_scene().save(folder / "in.glb");
  compress(in, folder / "out.gltf");
  compress(in, folder / "out.glb");
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"in.glb", "out.bin", "out.glb", "out.gltf"}));
  expect_equal(read_gltf_mesh(folder / "out.gltf"), read_gltf_mesh(folder / "out.glb"));
}

TEST(Compress, DecompressingKeepsTheSceneToo) {
  TemporaryFolder folder;
  SceneBuilder scene = rich_scene();
  std::string in = scene.save(folder / "in.glb");
  compress(in, folder / "out.glb");
  EXPECT_EQ(decompress_gltf(folder / "out.glb", folder / "plain.glb"), 1u);
  keep(folder / "plain.glb");
  Glb before = read_glb(in), after = read_glb(folder / "plain.glb");
  for (const char* key :
       {"asset", "scene", "scenes", "nodes", "materials", "textures", "cameras", "extras", "extensionsUsed"})
    EXPECT_EQ(before.json[key], after.json[key]) << key;
  expect_equal(read_gltf_mesh(folder / "out.glb"), read_gltf_mesh(folder / "plain.glb"));
}

TEST(Compress, JsonNumbersSurviveExactly) {
  TemporaryFolder folder;
  SceneBuilder scene = rich_scene();
  scene.json["extras"]["numbers"] = {0.1, 1e300, -5e-324, 9007199254740993, 18446744073709551615u, -7, 1.0};
  scene.json["extras"]["text"] = "\u00e4 \"quoted\" \\ \n \u2764";
  std::string in = scene.save(folder / "in.glb");
  compress(in, folder / "out.glb");
  EXPECT_EQ(read_glb(folder / "out.glb").json["extras"].dump(), scene.json["extras"].dump());
}

TEST(Compress, NothingToDoGivesTheSameScene) {
  TemporaryFolder folder;
  SceneBuilder scene;
  TestJson lines = scene.primitive(make_cube(2));
  lines["mode"] = 1;
  scene.mesh({lines});
  std::string in = scene.save(folder / "in.glb");
  auto reports = compress(in, folder / "out.glb");
  EXPECT_FALSE(reports.at(0).compressed);
  EXPECT_EQ(read_bytes(in), read_bytes(folder / "out.glb"));
}

// With indices, points are drawn more than once.
TEST(Compress, PointsStayPoints) {
  for (bool indexed : {false, true}) {
    TemporaryFolder folder;
    SceneBuilder scene;
    TriangleMesh sphere = make_bumpy_sphere(4);
    TestJson primitive = scene.primitive(sphere);
    primitive["mode"] = 0;
    if (!indexed) primitive.erase("indices");
    scene.mesh({primitive});
    const std::string in = scene.save(folder / "in.glb");
    const TriangleMesh cloud = read_gltf_mesh(in);
    EXPECT_TRUE(cloud.triangles.empty());
    EXPECT_EQ(cloud.positions.size(), indexed ? 3 * sphere.triangles.size() : sphere.positions.size());
    auto reports = compress(in, folder / "out.glb");
    ASSERT_TRUE(reports.at(0).compressed) << reports.at(0).reason;
    keep(folder / "out.glb");
    const TestJson json = read_glb(folder / "out.glb").json;
    const TestJson& after = json["meshes"][0]["primitives"][0];
    EXPECT_EQ(after["mode"], 0);
    EXPECT_FALSE(after.contains("indices"));
    EXPECT_EQ(json["accessors"].size(), indexed ? 2u : 3u);  // the scene has one that nothing refers to
    EXPECT_EQ(json["accessors"][0]["count"], decoded_sphere().positions.size());
    expect_equal(read_gltf_mesh(folder / "out.glb"),
                 decoded_sphere());  // what the encoder of these tests makes
  }
}

TEST(Compress, SeveralBuffersBecomeOne) {
  TemporaryFolder folder;
  SceneBuilder scene;
  TestJson lines = scene.primitive(make_cube(2));
  lines["mode"] = 1;
  scene.mesh({lines});
  scene.glb();
  scene.json["buffers"][0]["uri"] = "one.bin";
  write_bytes(folder / "one.bin", scene.binary);
  write_bytes(folder / "two.bin", {1, 2, 3, 4, 5, 6, 7, 8});
  scene.json["buffers"].push_back({{"uri", "two.bin"}, {"byteLength", 8}});
  scene.json["bufferViews"].push_back({{"buffer", 1}, {"byteOffset", 4}, {"byteLength", 4}});
  size_t spare = scene.json["bufferViews"].size() - 1;  // nothing refers to it, but that is not our business
  write_text(folder / "in.gltf", scene.json.dump());
  compress(folder / "in.gltf", folder / "out.glb");
  Glb after = read_glb(folder / "out.glb");
  EXPECT_EQ(after.json["buffers"].size(), 1u);
  EXPECT_EQ(after.binary.size(), (scene.binary.size() + 3) / 4 * 4 + 8);
  EXPECT_EQ(after.view(spare), (TestBytes{5, 6, 7, 8}));
  EXPECT_EQ(after.json["accessors"], scene.json["accessors"]);
  keep(folder / "out.glb");
}

TEST(Compress, SaysWhyAPrimitivePassesThrough) {
  TriangleMesh sphere = make_bumpy_sphere(4);
  auto with_attribute = [](const char* name) {
    return [name](SceneBuilder&, TestJson& p) { p["attributes"][name] = p["attributes"]["POSITION"]; };
  };
  std::map<std::string, std::function<void(SceneBuilder&, TestJson&)>> cases = {
      {"attribute TEXCOORD_0", with_attribute("TEXCOORD_0")},
      {"colours that are not opaque",
       [&](SceneBuilder& s, TestJson& p) {
         p["attributes"]["COLOR_0"] =
             s.colors(std::vector<std::array<uint8_t, 4>>(sphere.positions.size(), {255, 0, 0, 254}));
       }},
      {"attribute COLOR_1", with_attribute("COLOR_1")},
      {"attribute JOINTS_0", with_attribute("JOINTS_0")},
      {"attribute _FEATURE_ID_0", with_attribute("_FEATURE_ID_0")},
      {"morph targets",
       [](SceneBuilder&, TestJson& p) {
         p["targets"] = TestJson::array();
         p["targets"].push_back({{"POSITION", p["attributes"]["POSITION"]}});
       }},
      {"draws lines", [](SceneBuilder&, TestJson& p) { p["mode"] = 1; }},
      {"extension EXT_unheard_of",
       [](SceneBuilder&, TestJson& p) { p["extensions"]["EXT_unheard_of"]["a"] = 1; }},
      {"EXT_structural_metadata may refer", [](SceneBuilder& s, TestJson&) {
         s.json["extensions"]["EXT_structural_metadata"]["propertyTables"] = {{{"values", 0}}};
       }}};
  for (const auto& [reason, change] : cases) {
    TemporaryFolder folder;
    SceneBuilder scene;
    TestJson primitive = scene.primitive(sphere);
    change(scene, primitive);
    scene.mesh({primitive});
    std::string in = scene.save(folder / "in.glb");
    auto reports = compress(in, folder / "out.glb");
    EXPECT_FALSE(reports.at(0).compressed) << reason;
    EXPECT_NE(reports.at(0).reason.find(reason), std::string::npos) << reports.at(0).reason;
    EXPECT_EQ(read_bytes(in), read_bytes(folder / "out.glb")) << reason;
  }
}

TEST(Compress, ForeignCodecsStayIntact) {
  TemporaryFolder folder;
  SceneBuilder scene;
  TestJson statue = scene.primitive(make_bumpy_sphere(4));
  TestBytes secret = {1, 2, 3, 4, 5, 6, 7};
  size_t draco = scene.view(secret);
  TestJson shell = {{"attributes", {{"POSITION", scene.accessor(9, "VEC3", 5126, TestJson::object())}}},
                    {"indices", scene.accessor(27, "SCALAR", 5125, TestJson::object())}};
  shell["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", draco},
                                                       {"attributes", {{"POSITION", 0}}}};
  scene.mesh({statue});
  scene.mesh({shell});
  auto reports = compress(scene.save(folder / "in.glb"), folder / "out.glb");
  EXPECT_TRUE(reports.at(0).compressed);
  EXPECT_EQ(reports.at(1).reason, "is compressed with KHR_draco_mesh_compression");
  Glb after = read_glb(folder / "out.glb");
  const TestJson& codec =
      after.json["meshes"][1]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"];
  EXPECT_EQ(after.view(codec["bufferView"].get<size_t>()), secret);
  EXPECT_EQ(codec["attributes"], TestJson({{"POSITION", 0}}));
  const TestJson& primitive = after.json["meshes"][1]["primitives"][0];
  EXPECT_EQ(after.json["accessors"][primitive["attributes"]["POSITION"].get<int>()]["count"], 9);
  EXPECT_EQ(after.json["accessors"][primitive["indices"].get<int>()]["count"], 27);
}

TEST(Compress, MeshoptViewsMoveWithTheirBuffers) {
  TemporaryFolder folder;
  SceneBuilder scene;
  TestJson statue = scene.primitive(make_bumpy_sphere(4));
  size_t hidden = scene.view({9, 8, 7, 6});  // the compressed bytes; described by the view below only
  TestJson source = scene.json["bufferViews"][hidden];
  scene.json["bufferViews"].erase(hidden);
  TestJson fallback = {{"buffer", 1}, {"byteOffset", 0}, {"byteLength", 120}, {"byteStride", 12}};
  fallback["extensions"]["EXT_meshopt_compression"] = {
      {"buffer", 0},          {"byteOffset", source["byteOffset"]},
      {"byteLength", 4},      {"byteStride", 12},
      {"mode", "ATTRIBUTES"}, {"count", 10}};
  scene.json["bufferViews"].push_back(fallback);
  size_t view = scene.json["bufferViews"].size() - 1;
  TestJson other = {{"attributes", {{"POSITION", scene.accessor(10, "VEC3", 5126, {{"bufferView", view}})}}}};
  scene.mesh({statue});
  scene.mesh({other});
  scene.glb();
  scene.json["buffers"].push_back(
      {{"byteLength", 120}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}});
  write_bytes(folder / "in.glb", make_glb(scene.json, scene.binary));
  auto reports = compress(folder / "in.glb", folder / "out.glb");
  EXPECT_TRUE(reports.at(0).compressed);
  EXPECT_EQ(reports.at(1).reason, "is compressed with EXT_meshopt_compression");
  Glb after = read_glb(folder / "out.glb");
  ASSERT_EQ(after.json["buffers"].size(), 2u);
  EXPECT_EQ(after.json["buffers"][1]["byteLength"], 120);
  for (const TestJson& v : after.json["bufferViews"]) {
    if (!v.contains("extensions")) continue;
    const TestJson& codec = v["extensions"]["EXT_meshopt_compression"];
    EXPECT_EQ(v["buffer"], 1);
    EXPECT_EQ(codec["buffer"], 0);
    auto at = after.binary.begin() + codec["byteOffset"].get<int>();
    EXPECT_EQ(TestBytes(at, at + 4), (TestBytes{9, 8, 7, 6}));
  }
}

// --- Sharing
// -------------------------------------------------------------------------------------------------------

TEST(Compress, GeometryUsedTwiceIsEncodedOnce) {
  TemporaryFolder folder;
  SceneBuilder scene;
  TestJson primitive = scene.primitive(make_bumpy_sphere(4));
  scene.mesh({primitive}, "a");
  primitive["extras"] = 5;
  scene.mesh({primitive}, "b");
  FakeEncoder encoder;
  auto reports = compress_gltf(scene.save(folder / "in.glb"), folder / "out.glb", encoder.function());
  EXPECT_EQ(encoder.calls, 1);
  EXPECT_EQ(encoder.shares, std::vector<double>{1.0});
  EXPECT_TRUE(reports.at(0).compressed && reports.at(1).compressed);
  Glb after = read_glb(folder / "out.glb");
  keep(folder / "out.glb");
  EXPECT_EQ(after.json["bufferViews"].size(), 1u);
  EXPECT_EQ(extension_of(after.json, 0, 0), extension_of(after.json, 1, 0));
  EXPECT_EQ(read_streams(folder / "out.glb").size(), 1u);
  EXPECT_EQ(decompress_gltf(folder / "out.glb", folder / "plain.glb"), 2u);
  EXPECT_EQ(read_glb(folder / "plain.glb").json["bufferViews"].size(), 3u);
}

TEST(Compress, SharedAccessorsAreNotAltered) {
  TemporaryFolder folder;
  SceneBuilder scene;
  TriangleMesh sphere = make_bumpy_sphere(4);
  TestJson primitive = scene.primitive(sphere);
  TestJson lines = {{"attributes", primitive["attributes"]}, {"mode", 1}};
  scene.mesh({primitive});
  scene.mesh({lines});
  auto reports = compress(scene.save(folder / "in.glb"), folder / "out.glb");
  ASSERT_TRUE(reports.at(0).compressed) << reports.at(0).reason;  // the indices alone are worth it
  Glb after = read_glb(folder / "out.glb");
  keep(folder / "out.glb");
  int old = after.json["meshes"][1]["primitives"][0]["attributes"]["POSITION"].get<int>();
  int fresh = after.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"].get<int>();
  EXPECT_NE(old, fresh);
  EXPECT_EQ(after.view(after.json["accessors"][size_t(old)]["bufferView"].get<size_t>()),
            to_bytes(sphere.positions));
  EXPECT_FALSE(after.json["accessors"][size_t(fresh)].contains("bufferView"));
}

TEST(Compress, BytesThatStayForOthersDoNotCountAsSaved) {
  TemporaryFolder folder;
  SceneBuilder scene;
  TestJson primitive = scene.primitive(make_bumpy_sphere(4));
  TestJson both = primitive;
  both["attributes"]["TEXCOORD_0"] =
      both["attributes"]["POSITION"];  // the same vertices and indices, textured
  scene.mesh({primitive});
  scene.mesh({both});
  std::string in = scene.save(folder / "in.glb");
  auto reports = compress(in, folder / "out.glb");
  EXPECT_FALSE(reports.at(0).compressed);
  EXPECT_NE(reports.at(0).reason.find("would not shrink"), std::string::npos) << reports.at(0).reason;
  EXPECT_EQ(read_bytes(in), read_bytes(folder / "out.glb"));
}

TEST(Compress, PrimitivesThatWouldGrowPassThrough) {
  TemporaryFolder folder;
  SceneBuilder scene;
  scene.mesh({scene.primitive(make_cube(1))});
  auto reports = compress(scene.save(folder / "in.glb"), folder / "out.glb");
  EXPECT_FALSE(reports.at(0).compressed);
  EXPECT_NE(reports.at(0).reason.find("would not shrink"), std::string::npos);
  EXPECT_TRUE(reports.at(0).result.stream.empty());
}

TEST(Compress, PrimitivesThatTheEncoderRefusesPassThrough) {
  TemporaryFolder folder;
  SceneBuilder scene;
  scene.mesh({scene.primitive(make_bumpy_sphere(4))});
  auto reports =
      compress_gltf(scene.save(folder / "in.glb"), folder / "out.glb",
                    [](const TriangleMesh&, double) -> EncodeResult { throw InputError("too odd"); });
  EXPECT_EQ(reports.at(0).reason, "too odd");
}

TEST(Compress, OneViewForManyPrimitivesShrinks) {
  TemporaryFolder folder;
  SceneBuilder scene;
  TriangleMesh sphere = make_bumpy_sphere(4), cube = make_cube(1);
  std::vector<std::array<float, 3>> all = sphere.positions;
  all.insert(all.end(), cube.positions.begin(), cube.positions.end());
  size_t view = scene.view(to_bytes(all), 34962);
  TestJson first = SceneBuilder::bounds(sphere.positions), second = SceneBuilder::bounds(cube.positions);
  first["bufferView"] = second["bufferView"] = view;
  second["byteOffset"] = sphere.positions.size() * 12;
  TestJson a = {{"attributes", {{"POSITION", scene.accessor(sphere.positions.size(), "VEC3", 5126, first)}}},
                {"indices", scene.indices(sphere.triangles)}};
  TestJson b = {{"attributes", {{"POSITION", scene.accessor(cube.positions.size(), "VEC3", 5126, second)}}},
                {"indices", scene.indices(cube.triangles)}};
  scene.mesh({a});
  scene.mesh({b});
  auto reports = compress(scene.save(folder / "in.glb"), folder / "out.glb");
  EXPECT_TRUE(reports.at(0).compressed);
  EXPECT_FALSE(reports.at(1).compressed);
  Glb after = read_glb(folder / "out.glb");
  keep(folder / "out.glb");
  EXPECT_LE(after.binary.size(),
            sphere_stream().size() + cube.positions.size() * 12 + cube.triangles.size() * 12 + 12);
  TriangleMesh expected = joined(decoded_sphere(), cube);
  EXPECT_EQ(corners(read_gltf_mesh(folder / "out.glb")), corners(expected));
}

TEST(Compress, InterleavedVerticesAreReadAndReplaced) {
  TemporaryFolder folder;
  SceneBuilder scene;
  TriangleMesh sphere = make_bumpy_sphere(4);
  std::vector<std::array<float, 3>> mixed;
  for (const auto& p : sphere.positions) mixed.insert(mixed.end(), {p, {0, 0, 1}});
  size_t view = scene.view(to_bytes(mixed), 34962);
  scene.json["bufferViews"][view]["byteStride"] = 24;
  TestJson bounds = SceneBuilder::bounds(sphere.positions);
  bounds["bufferView"] = view;
  size_t p = scene.accessor(sphere.positions.size(), "VEC3", 5126, bounds);
  size_t n =
      scene.accessor(sphere.positions.size(), "VEC3", 5126, {{"bufferView", view}, {"byteOffset", 12}});
  scene.mesh(
      {{{"attributes", {{"POSITION", p}, {"NORMAL", n}}}, {"indices", scene.indices(sphere.triangles)}}});
  std::string in = scene.save(folder / "in.glb");
  TriangleMesh mesh = read_gltf_mesh(in);
  expect_equal(mesh, sphere);
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  EXPECT_EQ(mesh.normals[5], (std::array<float, 3>{0, 0, 1}));
  EXPECT_TRUE(compress(in, folder / "out.glb").at(0).compressed);
  keep(folder / "out.glb");
  EXPECT_EQ(read_glb(folder / "out.glb").binary.size(), (sphere_stream().size() + 3) / 4 * 4);
}

// --- Primitives that touch
// -----------------------------------------------------------------------------------------

TEST(Compress, PrimitivesThatShareABorderPassThrough) {
  TemporaryFolder folder;
  SceneBuilder scene;
  TriangleMesh lower = make_bumpy_sphere(4), upper = lower;
  size_t half = lower.triangles.size() / 2;
  lower.triangles.resize(half);
  upper.triangles.erase(upper.triangles.begin(), upper.triangles.begin() + ptrdiff_t(half));
  scene.mesh({scene.primitive(lower), scene.primitive(upper)});
  auto reports = compress(scene.save(folder / "in.glb"), folder / "out.glb");
  EXPECT_EQ(reports.at(0).reason, "touches primitive 1 of its mesh");
  EXPECT_EQ(reports.at(1).reason, "touches primitive 0 of its mesh");
}

TEST(Compress, PrimitivesApartAreCompressedWithTheirShares) {
  TemporaryFolder folder;
  SceneBuilder scene;
  TriangleMesh large = make_bumpy_sphere(4), small = moved(make_bumpy_sphere(3), 9, 0, 0);
  scene.mesh({scene.primitive(large), scene.primitive(small)});
  FakeEncoder encoder;
  auto reports = compress_gltf(scene.save(folder / "in.glb"), folder / "out.glb", encoder.function());
  EXPECT_TRUE(reports.at(0).compressed);
  EXPECT_TRUE(reports.at(1).compressed) << reports.at(1).reason;
  ASSERT_EQ(encoder.shares.size(), 2u);
  keep(folder / "out.glb");
  EXPECT_DOUBLE_EQ(encoder.shares[0], 2562.0 / (2562 + 642));
  EXPECT_DOUBLE_EQ(encoder.shares[0] + encoder.shares[1], 1);
}

TEST(Compress, ATexturedNeighbourKeepsAPrimitivePlain) {
  TemporaryFolder folder;
  SceneBuilder scene;
  TriangleMesh lower = make_bumpy_sphere(4), upper = lower;
  size_t half = lower.triangles.size() / 2;
  lower.triangles.resize(half);
  upper.triangles.erase(upper.triangles.begin(), upper.triangles.begin() + ptrdiff_t(half));
  TestJson textured = scene.primitive(upper);
  textured["attributes"]["TEXCOORD_0"] = textured["attributes"]["POSITION"];
  scene.mesh({scene.primitive(lower), textured});
  EXPECT_EQ(compress(scene.save(folder / "in.glb"), folder / "out.glb").at(0).reason,
            "touches primitive 1 of its mesh");
}

// --- Reading
// -------------------------------------------------------------------------------------------------------

TEST(Read, StripsFansAndPlainLists) {
  // A square around (0, 0) as two triangles, counter-clockwise seen from +z.
  std::vector<std::array<float, 3>> fan = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  std::vector<std::array<float, 3>> strip = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  std::vector<std::array<float, 3>> list = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  std::map<int, std::vector<std::array<float, 3>>> modes = {{4, list}, {5, strip}, {6, fan}};
  for (const auto& [mode, positions] : modes) {
    TemporaryFolder folder;
    SceneBuilder scene;
    scene.mesh({{{"attributes", {{"POSITION", scene.positions(positions)}}}, {"mode", mode}}});
    TriangleMesh mesh = read_gltf_mesh(scene.save(folder / "in.glb"));
    ASSERT_EQ(mesh.triangles.size(), 2u) << mode;
    for (const auto& t : mesh.triangles) {
      const auto &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
      float area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
      EXPECT_EQ(area, 1) << mode;
    }
  }
}

TEST(Read, SmallIndicesAndQuantisedPositions) {
  TriangleMesh cube = make_cube(2);
  for (int component : {5121, 5123}) {
    TemporaryFolder folder;
    SceneBuilder scene;
    std::vector<uint8_t> bytes;
    std::vector<uint16_t> shorts;
    for (const auto& t : cube.triangles)
      for (uint32_t v : t) bytes.push_back(uint8_t(v)), shorts.push_back(uint16_t(v));
    size_t indices =
        scene.accessor(3 * cube.triangles.size(), "SCALAR", component,
                       {{"bufferView", scene.view(component == 5121 ? bytes : to_bytes(shorts))}});
    std::vector<std::array<int8_t, 4>> packed;  // normalised bytes, 4 to keep the stride a multiple of 4
    for (const auto& p : cube.positions)
      packed.push_back({int8_t(127 * p[0]), int8_t(127 * p[1]), int8_t(-128), 0});
    size_t view = scene.view(to_bytes(packed));
    scene.json["bufferViews"][view]["byteStride"] = 4;
    size_t positions =
        scene.accessor(packed.size(), "VEC3", 5120, {{"bufferView", view}, {"normalized", true}});
    scene.mesh({{{"attributes", {{"POSITION", positions}}}, {"indices", indices}}});
    TriangleMesh mesh = read_gltf_mesh(scene.save(folder / "in.glb"));
    EXPECT_EQ(mesh.triangles, cube.triangles);
    for (size_t i = 0; i < mesh.positions.size(); i++) {
      EXPECT_EQ(mesh.positions[i][0], cube.positions[i][0]);
      EXPECT_EQ(mesh.positions[i][2], -1);  // -128 is clamped
    }
  }
}

TEST(Read, SparseAccessors) {
  TemporaryFolder folder;
  SceneBuilder scene;
  std::vector<std::array<float, 3>> moved_to = {{5, 5, 5}};
  size_t where = scene.view(to_bytes(std::vector<uint16_t>{2})), what = scene.view(to_bytes(moved_to));
  TestJson sparse = {{"count", 1},
                     {"indices", {{"bufferView", where}, {"componentType", 5123}}},
                     {"values", {{"bufferView", what}}}};
  std::vector<std::array<float, 3>> base = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  size_t p = scene.positions(base);
  scene.json["accessors"][p]["sparse"] = sparse;
  size_t zeros = scene.accessor(3, "VEC3", 5126, {{"sparse", sparse}});
  scene.mesh({{{"attributes", {{"POSITION", p}}}}});
  scene.mesh({{{"attributes", {{"POSITION", zeros}}}}});
  TriangleMesh mesh = read_gltf_mesh(scene.save(folder / "in.glb"));
  EXPECT_EQ(mesh.positions, (std::vector<std::array<float, 3>>{
                                {0, 0, 0}, {1, 0, 0}, {5, 5, 5}, {0, 0, 0}, {0, 0, 0}, {5, 5, 5}}));
}

TEST(Read, BuffersInDataUrisAndFiles) {
  TemporaryFolder folder;
  SceneBuilder scene;
  TriangleMesh triangle;
  triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  scene.mesh({{{"attributes", {{"POSITION", scene.positions(triangle.positions)}}}}});
  scene.glb();
  scene.json["buffers"][0]["uri"] = "a%20%C3%A4.bin";
  write_bytes(folder / "a \u00e4.bin", scene.binary);
  write_text(folder / "file.gltf", scene.json.dump());
  EXPECT_EQ(read_gltf_mesh(folder / "file.gltf").positions, triangle.positions);
  // 36 bytes: nine floats, of which the fourth and eighth are 1 (00 00 80 3f)
  scene.json["buffers"][0]["uri"] =
      "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
  write_text(folder / "data.gltf", scene.json.dump());
  EXPECT_EQ(read_gltf_mesh(folder / "data.gltf").positions, triangle.positions);
}

TEST(Read, TransformsAndMirrors) {
  TemporaryFolder folder;
  SceneBuilder scene;
  TriangleMesh sphere = make_sphere(2);
  scene.mesh({scene.primitive(sphere)});
  double volume = signed_volume(sphere);
  scene.json["nodes"][0] = {{"mesh", 0}, {"scale", {-2.0, 1.0, 1.0}}, {"translation", {10.0, 0.0, 0.0}}};
  TriangleMesh mirrored = read_gltf_mesh(scene.save(folder / "mirrored.glb"));
  EXPECT_NEAR(signed_volume(mirrored), 2 * volume, 1e-4);
  float low = std::numeric_limits<float>::max();
  for (const auto& p : mirrored.positions) low = std::min(low, p[0]);
  EXPECT_NEAR(low, 8, 1e-5);

  // A quarter turn about z under a parent that moves by (1, 2, 3): x -> y.
  double s = std::sqrt(0.5);
  scene.json["nodes"] = TestJson::array();
  scene.json["nodes"].push_back(
      {{"children", {1}}, {"matrix", {1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 1., 2., 3., 1.}}});
  scene.json["nodes"].push_back({{"mesh", 0}, {"rotation", {0., 0., s, s}}});
  TriangleMesh turned = read_gltf_mesh(scene.save(folder / "turned.glb"));
  for (size_t i = 0; i < sphere.positions.size(); i++) {
    EXPECT_NEAR(turned.positions[i][0], 1 - sphere.positions[i][1], 1e-6);
    EXPECT_NEAR(turned.positions[i][1], 2 + sphere.positions[i][0], 1e-6);
    EXPECT_NEAR(turned.positions[i][2], 3 + sphere.positions[i][2], 1e-6);
  }
}

TEST(Read, OnlyTheDefaultScene) {
  TemporaryFolder folder;
  SceneBuilder scene;
  scene.mesh({scene.primitive(make_cube(1))});
  scene.mesh({scene.primitive(make_sphere(1))});
  scene.json["scenes"] = TestJson::parse(R"([{"nodes": [0]}, {"nodes": [1]}])");
  scene.json["scene"] = 1;
  EXPECT_EQ(read_gltf_mesh(scene.save(folder / "one.glb")).triangles.size(), 80u);
  scene.json.erase("scene");
  EXPECT_EQ(read_gltf_mesh(scene.save(folder / "all.glb")).triangles.size(), 92u);
}

// --- Hostile files
// -------------------------------------------------------------------------------------------------

struct Hostile {
  const char* expected;  // part of the message
  std::function<void(SceneBuilder&)> change;
};

std::vector<Hostile> hostile_changes() {
  return {
      {"is its own descendant", [](SceneBuilder& s) { s.json["nodes"][0]["children"] = {0}; }},
      {"out of range: 7", [](SceneBuilder& s) { s.json["nodes"][0]["mesh"] = 7; }},
      {"not an index", [](SceneBuilder& s) { s.json["nodes"][0]["mesh"] = -1; }},
      {"accessor index 99 is out of range",
       [](SceneBuilder& s) { s.json["meshes"][0]["primitives"][0]["indices"] = 99; }},
      {"accessor index is not an integer",
       [](SceneBuilder& s) { s.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = "zero"; }},
      {"bufferView index 50", [](SceneBuilder& s) { s.json["accessors"][0]["bufferView"] = 50; }},
      {"exceeds its buffer view", [](SceneBuilder& s) { s.json["accessors"][0]["count"] = 1000000; }},
      {"exceeds its buffer view",
       [](SceneBuilder& s) { s.json["accessors"][0]["count"] = std::numeric_limits<uint64_t>::max(); }},
      {"exceeds its buffer view",
       [](SceneBuilder& s) {
         s.json["accessors"][0]["byteOffset"] = std::numeric_limits<uint64_t>::max() - 3;
       }},
      {"not a non-negative integer", [](SceneBuilder& s) { s.json["accessors"][0]["count"] = -4; }},
      {"not a non-negative integer", [](SceneBuilder& s) { s.json["accessors"][0]["count"] = 8.5; }},
      {"exceeds its buffer", [](SceneBuilder& s) { s.json["bufferViews"][0]["byteLength"] = 99999999; }},
      {"exceeds its buffer",
       [](SceneBuilder& s) {
         s.json["bufferViews"][0]["byteOffset"] = std::numeric_limits<uint64_t>::max();
       }},
      {"stride", [](SceneBuilder& s) { s.json["bufferViews"][0]["byteStride"] = 4; }},
      {"wrong type", [](SceneBuilder& s) { s.json["accessors"][0]["type"] = "VEC2"; }},
      {"wrong type", [](SceneBuilder& s) { s.json["accessors"][1]["componentType"] = 5126; }},
      {"is out of range: 1 of 1 vertices", [](SceneBuilder& s) { s.json["accessors"][0]["count"] = 1; }},
      {"primitives is not an array", [](SceneBuilder& s) { s.json["meshes"][0]["primitives"] = "many"; }},
      {"attributes is missing",
       [](SceneBuilder& s) { s.json["meshes"][0]["primitives"][0].erase("attributes"); }},
      {"nodes[0] is not an object", [](SceneBuilder& s) { s.json["nodes"][0] = 3; }},
      {"not an array of 16 numbers",
       [](SceneBuilder& s) {
         s.json["nodes"][0]["matrix"] = {1, 2, 3};
       }},
      {"not finite in world space",
       [](SceneBuilder& s) {
         s.json["nodes"][0]["scale"] = {1e300, 1e300, 1e300};
       }},
      {"version '1.0'", [](SceneBuilder& s) { s.json["asset"]["version"] = "1.0"; }},
      {"asset", [](SceneBuilder& s) { s.json.erase("asset"); }},
      {"vertex 2 is not finite",
       [](SceneBuilder& s) {
         float nan = std::numeric_limits<float>::quiet_NaN();
         std::memcpy(&s.binary[2 * 12 + 4], &nan, 4);
       }},
      {"vertex 0 is not finite",
       [](SceneBuilder& s) {
         float infinity = std::numeric_limits<float>::infinity();
         std::memcpy(&s.binary[0], &infinity, 4);
       }},
      {"compressed with KHR_draco",
       [](SceneBuilder& s) {
         s.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {
             {"bufferView", 0}};
       }},
      {"has no bufferView",
       [](SceneBuilder& s) {
         s.json["meshes"][0]["primitives"][0]["extensions"]["RELIEF_patch_compression"] = TestJson::object();
       }},
      {"mesh 0 primitive 0",
       [](SceneBuilder& s) {  // not a stream
         s.json["meshes"][0]["primitives"][0]["extensions"]["RELIEF_patch_compression"] = {{"bufferView", 0}};
       }},
      {"no vertices", [](SceneBuilder& s) { s.json["scenes"][0]["nodes"] = TestJson::array(); }},
  };
}

TEST(Hostile, OneLineSaysWhatIsWrong) {
  for (const Hostile& hostile : hostile_changes()) {
    TemporaryFolder folder;
    SceneBuilder scene;
    scene.mesh({scene.primitive(make_cube(1))});
    hostile.change(scene);
    std::string in = scene.save(folder / "in.glb");
    std::string error = error_of([&] { read_gltf_mesh(in); });
    EXPECT_NE(error.find(hostile.expected), std::string::npos) << hostile.expected << " / " << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    // Compressing it fails as well or passes it through, but leaves nothing half-written.
    bool failed = !error_of([&] { compress(in, folder / "out.glb"); }).empty();
    EXPECT_EQ(folder.names().size(), failed ? 1u : 2u) << hostile.expected;
  }
}

TEST(Hostile, NotGlbAtAll) {
  TemporaryFolder folder;
  write_text(folder / "a.glb", "this is no binary glTF file at all");
  EXPECT_EQ(error_of([&] { read_gltf_mesh(folder / "a.glb"); }), "is not a GLB file");
  write_text(folder / "b.gltf", "{\"asset\": {\"version\": ");
  EXPECT_NE(error_of([&] { read_gltf_mesh(folder / "b.gltf"); }).find("not valid JSON"), std::string::npos);
  write_text(folder / "c.gltf", std::string(100000, '['));
  EXPECT_EQ(error_of([&] { read_gltf_mesh(folder / "c.gltf"); }), "JSON is nested too deeply");
  EXPECT_EQ(error_of([&] { read_gltf_mesh(folder / "none.glb"); }), "no such file");
  EXPECT_EQ(error_of([&] { read_gltf_mesh(folder.path); }), "is not a regular file");
}

// Found by fuzzing: the search for chunks ran on from a length below that of the header.
TEST(Hostile, LengthShorterThanTheHeaderOfAGlb) {
  TemporaryFolder folder;
  SceneBuilder scene;
  scene.mesh({scene.primitive(make_cube(1))});
  const TestBytes glb = scene.glb();
  for (uint8_t length = 0; length < 12; length++) {
    TestBytes bytes = glb;
    bytes[8] = length, bytes[9] = bytes[10] = bytes[11] = 0;
    write_bytes(folder / "in.glb", bytes);
    EXPECT_EQ(error_of([&] { read_gltf_mesh(folder / "in.glb"); }),
              "is truncated: the length in its header is less than the header's");
  }
}

TEST(Hostile, EveryPrefixOfAGlbIsRefused) {
  TemporaryFolder folder;
  SceneBuilder scene;
  scene.mesh({scene.primitive(make_cube(1))});
  TestBytes glb = scene.glb();
  for (size_t size = 0; size < glb.size(); size++) {
    write_bytes(folder / "in.glb", TestBytes(glb.begin(), glb.begin() + ptrdiff_t(size)));
    EXPECT_NE(error_of([&] { read_gltf_mesh(folder / "in.glb"); }), "") << size;
    EXPECT_NE(error_of([&] { compress(folder / "in.glb", folder / "out.glb"); }), "") << size;
  }
  EXPECT_EQ(folder.names(), std::vector<std::string>{"in.glb"});
}

// Every byte of a plain and of a compressed GLB altered in three ways: InputError or success, nothing else.
TEST(Hostile, AlteredBytes) {
  TemporaryFolder folder;
  SceneBuilder scene;
  scene.mesh({scene.primitive(make_cube(1))});
  write_stream_gltf(folder / "stream.glb", sphere_stream());
  size_t read = 0, refused = 0;
  for (TestBytes glb : {scene.glb(), read_bytes(folder / "stream.glb")}) {
    size_t step = glb.size() > 2000 ? 3 : 1;
    for (size_t i = 0; i < glb.size(); i += step)
      for (uint8_t flip : {0x01, 0x10, 0x80}) {
        glb[i] ^= flip;
        write_bytes(folder / "in.glb", glb);
        error_of([&] { read_gltf_mesh(folder / "in.glb"); }).empty() ? read++ : refused++;
        error_of([&] { compress(folder / "in.glb", folder / "out.glb"); });
        error_of([&] { decompress_gltf(folder / "in.glb", folder / "out.glb"); });
        glb[i] ^= flip;
      }
  }
  EXPECT_GT(read, 0u);
  EXPECT_GT(refused, 0u);
  for (const std::string& name : folder.names()) EXPECT_EQ(name.find("tmp"), std::string::npos) << name;
}

TEST(Output, FailsWithoutLeavingAnything) {
  TemporaryFolder folder;
  std::string in = rich_scene().save(folder / "in.glb");
  EXPECT_NE(error_of([&] { compress(in, folder / "no/such/out.glb"); }), "");
  std::filesystem::create_directory(folder.path / "folder.glb");
  EXPECT_NE(error_of([&] { compress(in, folder / "folder.glb"); }), "");
  EXPECT_NE(error_of([&] { compress(in, folder / "out.obj"); }), "");
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"folder.glb", "in.glb"}));
}

TEST(Output, ImagesBesideTheInputMoveIntoTheGlbOfAnotherFolder) {
  TemporaryFolder folder;
  SceneBuilder scene = rich_scene();
  TestBytes png = {0x89, 'P', 'N', 'G', 42, 43};
  write_bytes(folder / "my picture.png", png);
  scene.json["images"] = TestJson::parse(R"([{"uri": "my%20picture.png", "name": "picture"}])");
  std::string in = scene.save(folder / "in.glb");
  compress(in, folder / "same.glb");
  EXPECT_EQ(read_glb(folder / "same.glb").json["images"], scene.json["images"]);
  std::filesystem::create_directory(folder.path / "other");
  compress(in, folder / "other/out.glb");
  Glb moved_out = read_glb(folder / "other/out.glb");
  const TestJson& image = moved_out.json["images"][0];
  EXPECT_EQ(image["name"], "picture");
  EXPECT_EQ(image["mimeType"], "image/png");
  EXPECT_EQ(moved_out.view(image["bufferView"].get<size_t>()), png);
}

}  // namespace
}  // namespace relief
