// The command line: exit codes, one-line errors, JSON, and files that are whole or absent.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "gltf_scenes.h"

namespace relief {
namespace {

struct Result {
  int code = -1;
  std::string out, err;
  TestJson json() const { return TestJson::parse(out); }
};

// Runs `relief ARGUMENTS` in a folder.
Result relief_in(const TemporaryFolder& folder, const std::string& arguments) {
  std::string err = folder / "stderr.txt";
  std::string command =
      "cd '" + folder.path.string() + "' && '" RELIEF_BINARY "' " + arguments + " 2>'" + err + "'";
  Result result;
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return result;
  char buffer[4096];
  for (size_t n; (n = fread(buffer, 1, sizeof(buffer), pipe)) > 0;) result.out.append(buffer, n);
  int status = pclose(pipe);
  result.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  TestBytes bytes = read_bytes(err);
  result.err.assign(bytes.begin(), bytes.end());
  std::filesystem::remove(err);
  return result;
}

std::string ply_of(const TriangleMesh& mesh) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(mesh.positions.size()) +
                     "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                     std::to_string(mesh.triangles.size()) +
                     "\nproperty list uchar int vertex_indices\nend_header\n";
  char line[128];
  for (const auto& p : mesh.positions) {
    std::snprintf(line, sizeof(line), "%.9g %.9g %.9g\n", p[0], p[1], p[2]);
    text += line;
  }
  for (const auto& t : mesh.triangles) {
    std::snprintf(line, sizeof(line), "3 %u %u %u\n", t[0], t[1], t[2]);
    text += line;
  }
  return text;
}

// "relief: ..." and nothing more.
void expect_one_line(const Result& result) {
  EXPECT_EQ(result.err.rfind("relief: ", 0), 0u) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

class CommandLine : public testing::Test {
 protected:
  void SetUp() override { write_text(folder / "torus.ply", ply_of(make_torus(48, 24))); }
  Result run(const std::string& arguments) { return relief_in(folder, arguments); }
  bool exists(const std::string& name) { return std::filesystem::exists(folder / name); }
  TemporaryFolder folder;
};

TEST_F(CommandLine, EncodesDecodesComparesAndInforms) {
  Result encoded = run("encode torus.ply t.glb --error 1e-3 --json");
  ASSERT_EQ(encoded.code, 0) << encoded.err;
  EXPECT_EQ(encoded.err, "");  // no progress bar, as stderr is no terminal
  TestJson report = encoded.json();
  EXPECT_EQ(report["output_bytes"], std::filesystem::file_size(folder / "t.glb"));
  EXPECT_EQ(report["primitives"][0]["vertices"], 48 * 24);
  EXPECT_LE(report["primitives"][0]["e_rms"].get<double>(), 10);

  Result compared = run("compare torus.ply t.glb --samples 100000 --json");
  ASSERT_EQ(compared.code, 0) << compared.err;
  EXPECT_LE(compared.json()["e_rms"].get<double>(), 10.3);  // other sample points than the encoder's
  EXPECT_EQ(compared.json()["a"]["genus"], 1);

  Result decoded = run("decode t.glb t.ply --json");
  ASSERT_EQ(decoded.code, 0) << decoded.err;
  Result part = run("decode t.glb part.ply --smooth --json --bytes " +
                    std::to_string(report["primitives"][0]["bytes_after"].get<size_t>() - 40));
  ASSERT_EQ(part.code, 0) << part.err;
  EXPECT_GT(part.json()["triangles"].get<size_t>(), 0u);
  Result coarse = run("decode t.glb coarse.ply --level 1 --json");
  ASSERT_EQ(coarse.code, 0) << coarse.err;
  EXPECT_LT(2 * coarse.json()["triangles"].get<size_t>(), decoded.json()["triangles"].get<size_t>());
  TestJson shape = run("compare t.ply coarse.ply --samples 20000 --json").json();
  EXPECT_EQ(shape["b"]["boundary_loops"], 0);
  EXPECT_EQ(run("decode t.glb coarse.glb --level 2 --quiet").code, 0);
  EXPECT_EQ(run("decode t.glb coarse.ply --level 5").code, 2);
  Result points = run("decode t.glb points.ply --points --json");
  ASSERT_EQ(points.code, 0) << points.err;
  EXPECT_EQ(points.json()["triangles"], 0);
  EXPECT_GT(points.json()["vertices"].get<size_t>(), 100u);
  EXPECT_LE(points.json()["vertices"].get<size_t>(), decoded.json()["vertices"].get<size_t>());
  EXPECT_EQ(run("decode t.glb points.obj --points --level 1 --quiet").code, 0);
  EXPECT_EQ(run("decode t.glb points.glb --points --quiet").code, 0);
  Result drawn = run("compare torus.ply points.glb --json");
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_EQ(drawn.json()["b"]["vertices"], points.json()["vertices"]);
  EXPECT_EQ(run("decode t.glb points.ply --points --smooth").code, 2);
  Result none = run("decode t.glb part.ply --bytes 10");
  EXPECT_EQ(none.code, 1);
  EXPECT_EQ(std::count(none.err.begin(), none.err.end(), '\n'), 1) << none.err;
  Result info = run("info t.glb --json");
  ASSERT_EQ(info.code, 0) << info.err;
  TestJson stream = info.json()["streams"][0];
  EXPECT_EQ(stream["bytes"], report["primitives"][0]["bytes_after"]);
  EXPECT_EQ(stream["vertex_count"], decoded.json()["vertices"]);
  EXPECT_EQ(stream["triangle_count"], decoded.json()["triangles"]);
  EXPECT_EQ(stream["bytes_header"].get<uint64_t>() + stream["bytes_side"].get<uint64_t>() +
                stream["bytes_masks"].get<uint64_t>() + stream["bytes_coefficients"].get<uint64_t>() +
                stream["bytes_seams"].get<uint64_t>(),
            stream["bytes"].get<uint64_t>());
  EXPECT_EQ(stream["patches"].size(), stream["patch_count"].get<size_t>());
  uint64_t masks = 0, coefficients = 0, bands = 0;
  for (const TestJson& patch : stream["patches"]) {
    masks += patch["bytes_masks"].get<uint64_t>();
    coefficients += patch["bytes_coefficients"].get<uint64_t>();
  }
  for (const TestJson& level : stream["bytes_by_band"])
    for (const char* band : {"LL", "HL", "LH", "HH"}) bands += level[band].get<uint64_t>();
  EXPECT_EQ(masks, stream["bytes_masks"].get<uint64_t>());
  EXPECT_EQ(coefficients, stream["bytes_coefficients"].get<uint64_t>());
  EXPECT_EQ(bands, stream["bytes_coefficients"].get<uint64_t>());
  EXPECT_EQ(stream["bytes_by_band"].size(), stream["bytes_by_level"].size());
  keep_for_validator(folder / "t.glb", "cli-encode.glb");
  EXPECT_NE(run("info t.glb").out.find("masks"), std::string::npos);
  EXPECT_NE(run("info t.glb --patches").out.find("coefficients"), std::string::npos);
}

TEST_F(CommandLine, PointsInPointsOrMeshOut) {
  const TriangleMesh torus = make_torus(96, 48);
  std::string xyz;
  for (const auto& p : torus.positions)
    xyz += std::to_string(p[0]) + " " + std::to_string(p[1]) + " " + std::to_string(p[2]) + "\n";
  write_text(folder / "cloud.xyz", xyz);
  Result encoded = run("encode cloud.xyz c.glb --error 5e-4 --json");
  ASSERT_EQ(encoded.code, 0) << encoded.err;
  EXPECT_EQ(encoded.json()["primitives"][0]["name"], "points");
  EXPECT_EQ(encoded.json()["primitives"][0]["triangles"], 0);
  Result one_way = run("compare cloud.xyz c.glb --json");
  ASSERT_EQ(one_way.code, 0) << one_way.err;
  EXPECT_LT(one_way.json()["e_rms"].get<double>(), 7);
  EXPECT_FALSE(one_way.json().contains("e_rms_ba"));

  Result mesh = run("decode c.glb mesh.ply --json");
  ASSERT_EQ(mesh.code, 0) << mesh.err;
  EXPECT_GT(mesh.json()["triangles"].get<size_t>(), 0u);
  for (const char* out : {"points.ply", "points.xyz", "points.glb"}) {
    Result points = run(std::string("decode c.glb ") + out + " --points --json");
    ASSERT_EQ(points.code, 0) << points.err;
    EXPECT_EQ(points.json()["triangles"], 0);
    EXPECT_LE(points.json()["vertices"], mesh.json()["vertices"]);  // which has some between the patches
    Result both = run(std::string("compare cloud.xyz ") + out + " --json");  // by projection
    ASSERT_EQ(both.code, 0) << both.err;
    EXPECT_LT(both.json()["e_rms"].get<double>(), 7) << out;
    EXPECT_TRUE(both.json().contains("e_rms_ba"));
  }
  EXPECT_EQ(run("decode c.glb mesh.xyz").code, 2);
  write_text(folder / "few.xyz", "0 0 0\n1 0 0\n0 1 0\n");
  Result few = run("encode few.xyz few.glb");
  EXPECT_EQ(few.code, 1);
  EXPECT_EQ(few.err, "relief: few.xyz: has too few points for a surface\n");
  EXPECT_FALSE(exists("few.glb"));
}

TEST_F(CommandLine, AllFormatsHoldTheSameSurface) {
  ASSERT_EQ(run("encode torus.ply a.glb --error 2e-3 --quiet").code, 0);
  ASSERT_EQ(run("encode torus.ply a.gltf --error 2e-3 --quiet").code, 0);
  ASSERT_EQ(run("encode torus.ply a.relief --error 2e-3 --quiet").code, 0);
  for (const char* in : {"a.glb", "a.gltf", "a.relief"})
    for (const char* out : {"b.glb", "b.gltf", "b.ply", "b.obj"}) {
      ASSERT_EQ(run(std::string("decode ") + in + " " + out + " --quiet").code, 0) << in << out;
      Result compared = run(std::string("compare a.relief ") + out + " --json --samples 2000");
      ASSERT_EQ(compared.code, 0) << compared.err;
      EXPECT_LE(compared.json()["e_max"].get<double>(), 0.01) << in << out;
    }
}

TEST_F(CommandLine, ThreadsDoNotChangeTheBytes) {
  ASSERT_EQ(run("encode torus.ply one.glb --error 1e-3 --quiet --threads 1").code, 0);
  ASSERT_EQ(run("encode torus.ply four.glb --error 1e-3 --quiet --threads 4").code, 0);
  EXPECT_EQ(read_bytes(folder / "one.glb"), read_bytes(folder / "four.glb"));
}

TEST_F(CommandLine, HeatmapAndPatches) {
  ASSERT_EQ(run("encode torus.ply t.glb --error 2e-3 --quiet --patches p.glb").code, 0);
  ASSERT_EQ(run("compare torus.ply t.glb --heatmap h.glb --quiet --samples 5000").code, 0);
  for (const char* name : {"p.glb", "h.glb"}) {
    keep_for_validator(folder / name, std::string("cli-") + name);
    Glb glb = read_glb(folder / name);
    const TestJson& attributes = glb.json["meshes"][0]["primitives"][0]["attributes"];
    ASSERT_TRUE(attributes.contains("COLOR_0")) << name;
    TestBytes colors =
        glb.view(glb.json["accessors"][attributes["COLOR_0"].get<size_t>()]["bufferView"].get<size_t>());
    EXPECT_NE(std::count(colors.begin(), colors.end(), colors[0]), ptrdiff_t(colors.size())) << name;
  }
}

TEST_F(CommandLine, TheHeatmapOfEqualSurfacesIsBlue) {
  ASSERT_EQ(run("compare torus.ply torus.ply --heatmap h.glb --quiet --samples 5000").code, 0);
  Glb glb = read_glb(folder / "h.glb");
  const TestJson& attributes = glb.json["meshes"][0]["primitives"][0]["attributes"];
  TestBytes colors =
      glb.view(glb.json["accessors"][attributes["COLOR_0"].get<size_t>()]["bufferView"].get<size_t>());
  for (size_t i = 0; i < colors.size(); i += 8)
    ASSERT_EQ(TestBytes(colors.begin() + ptrdiff_t(i), colors.begin() + ptrdiff_t(i) + 8),
              (TestBytes{0, 0, 0, 0, 255, 255, 255, 255}));
}

TEST_F(CommandLine, MeetsABudgetOfBytes) {
  Result encoded = run("encode torus.ply t.relief --bytes 1500 --json");
  ASSERT_EQ(encoded.code, 0) << encoded.err;
  EXPECT_LE(std::filesystem::file_size(folder / "t.relief"), 1500u);
}

// A bisk stream is another stream, of bit planes; how its bits are shared makes a difference.
TEST_F(CommandLine, CodesBitPlanes) {
  std::vector<TestBytes> streams;
  for (const char* options : {"", "--coder bisk", "--coder bisk --allocation even"}) {
    ASSERT_EQ(run(std::string("encode torus.ply t.relief --error 1e-3 --quiet ") + options).code, 0)
        << options;
    streams.push_back(read_bytes(folder / "t.relief"));
    Result compared = run("compare torus.ply t.relief --samples 100000 --json");
    EXPECT_LE(compared.json()["e_rms"].get<double>(), 10.3) << options;
  }
  EXPECT_NE(streams[0], streams[1]);
  EXPECT_NE(streams[1], streams[2]);
  TestJson stream = run("info t.relief --json").json()["streams"][0];
  uint64_t planes = 0;
  for (const TestJson& bytes : stream["bytes_by_plane"]) planes += bytes.get<uint64_t>();
  EXPECT_EQ(planes, stream["bytes_coefficients"].get<uint64_t>());
  EXPECT_NE(run("info t.relief").out.find("bit plane 0"), std::string::npos);
}

// --density: with 1 a patch has about as many pixels as vertices (3.4). Spacings are quarter powers of two
// apart, so that pixels are at most 19% more or fewer, and there is a rim around every patch. Twice the
// density is half the spacing.
TEST_F(CommandLine, DensityIsThatOfTheVertices) {
  write_text(folder / "sphere.ply", ply_of(make_sphere(5)));
  std::vector<double> spacing;
  for (const double density : {0.7, 1.4}) {
    const std::string mu = std::to_string(density);
    ASSERT_EQ(run("encode sphere.ply s.relief --error 5e-3 --quiet --density " + mu).code, 0);
    const TestJson stream = run("info s.relief --json").json()["streams"][0];
    const double share = stream["pixel_count"].get<double>() * density * density / 10242;
    EXPECT_GT(share, 0.8) << mu;
    EXPECT_LT(share, 1.4) << mu;
    spacing.push_back(stream["patches"][0]["spacing"].get<double>());
  }
  EXPECT_NEAR(spacing[1] / spacing[0], 2, 1e-6);
}

TEST_F(CommandLine, PartitionAsAsked) {
  const auto patches = [&](const std::string& options) {
    Result encoded = run("encode torus.ply t.relief --error 2e-3 --json " + options);
    EXPECT_EQ(encoded.code, 0) << options << encoded.err;
    EXPECT_LE(run("compare torus.ply t.relief --samples 100000 --json").json()["e_rms"].get<double>(), 20.6)
        << options;
    return encoded.json()["primitives"][0]["patches"].get<int>();
  };
  const int usual = patches("");
  EXPECT_EQ(patches("--partition gla --plane average --aperture 80"), usual);
  EXPECT_GT(patches("--aperture 30"), usual);
  EXPECT_LE(patches("--aperture 89"), usual);
  const TestBytes gla = read_bytes(folder / "t.relief");
  patches("--aperture 89 --partition split-merge");
  const TestBytes split_merge = read_bytes(folder / "t.relief");
  EXPECT_NE(split_merge, gla);
  patches("--aperture 89 --partition split-merge --plane cone");
  EXPECT_NE(read_bytes(folder / "t.relief"), split_merge);
  patches("--no-fit");
}

TEST_F(CommandLine, SaysWhenTheTargetCannotBeMet) {
  Result encoded = run("encode torus.ply t.relief --bytes 20");
  EXPECT_EQ(encoded.code, 3);
  EXPECT_NE(encoded.err.find("could not be met"), std::string::npos) << encoded.err;
  EXPECT_TRUE(exists("t.relief"));  // the best there is
  EXPECT_EQ(run("decode t.relief t.ply").code, 0);
}

TEST_F(CommandLine, SharesABudgetAmongPrimitives) {
  SceneBuilder scene;
  scene.mesh({scene.primitive(make_torus(48, 24))}, "a");
  scene.mesh({scene.primitive(make_bumpy_sphere(4))}, "b");
  scene.save(folder / "in.glb");
  Result encoded = run("encode in.glb out.glb --bytes 4000 --json");
  ASSERT_EQ(encoded.code, 0) << encoded.err;
  uint64_t bytes = 0;
  for (const TestJson& p : encoded.json()["primitives"]) {
    EXPECT_TRUE(p["compressed"].get<bool>());
    bytes += p["bytes_after"].get<uint64_t>();
  }
  EXPECT_LE(bytes, 4000u);
  keep_for_validator(folder / "out.glb", "cli-scene.glb");
}

TEST_F(CommandLine, SaysWhatPassesThrough) {
  SceneBuilder scene;
  TestJson primitive = scene.primitive(make_torus(24, 12));
  primitive["attributes"]["TEXCOORD_0"] = primitive["attributes"]["POSITION"];
  scene.mesh({primitive}, "pot");
  scene.save(folder / "in.glb");
  Result encoded = run("encode in.glb out.glb");
  EXPECT_EQ(encoded.code, 0);
  expect_one_line(encoded);
  EXPECT_NE(encoded.err.find("mesh 0 'pot' primitive 0: passed through: has the attribute TEXCOORD_0"),
            std::string::npos)
      << encoded.err;
  EXPECT_EQ(read_bytes(folder / "in.glb"), read_bytes(folder / "out.glb"));
  EXPECT_EQ(run("encode in.glb out.glb --quiet").err, "");
}

// Red where x is positive, else blue; one of two primitives in a scene.
TEST_F(CommandLine, ColoursOfAScene) {
  SceneBuilder scene;
  const TriangleMesh torus = make_torus(64, 32);
  std::vector<std::array<uint8_t, 4>> colors;
  for (const auto& p : torus.positions)
    colors.push_back(p[0] > 0 ? std::array<uint8_t, 4>{255, 0, 0, 255}
                              : std::array<uint8_t, 4>{0, 0, 255, 255});
  TestJson painted = scene.primitive(torus);
  painted["attributes"]["COLOR_0"] = scene.colors(colors);
  scene.mesh({painted}, "painted");
  scene.mesh({scene.primitive(make_bumpy_sphere(4))}, "plain");
  scene.save(folder / "in.glb");
  Result encoded = run("encode in.glb out.glb --error 2e-3 --json");
  ASSERT_EQ(encoded.code, 0) << encoded.err;
  TestJson report = TestJson::parse(encoded.out)["primitives"];
  EXPECT_LE(report[0]["color_error"].get<double>(), 4);
  EXPECT_FALSE(report[1].contains("color_error"));
  keep_for_validator(folder / "out.glb", "cli-colours.glb");

  ASSERT_EQ(run("decode out.glb plain.glb --quiet").code, 0);
  keep_for_validator(folder / "plain.glb", "cli-colours-plain.glb");
  const TestJson plain = read_glb(folder / "plain.glb").json;
  EXPECT_TRUE(plain["meshes"][0]["primitives"][0]["attributes"].contains("COLOR_0"));
  EXPECT_FALSE(plain["meshes"][1]["primitives"][0]["attributes"].contains("COLOR_0"));

  ASSERT_EQ(run("encode plain.glb bare.glb --error 2e-3 --no-colors --quiet").code, 0);
  for (const TestJson& mesh : read_glb(folder / "bare.glb").json["meshes"])
    EXPECT_FALSE(mesh["primitives"][0]["attributes"].contains("COLOR_0"));

  ASSERT_EQ(run("decode out.glb out.ply --quiet").code, 0);  // with the other primitive, in white
  ASSERT_EQ(run("encode out.ply again.relief --error 2e-3 --json").code, 0);
  ASSERT_EQ(run("info again.relief --json").code, 0);
  EXPECT_GT(TestJson::parse(run("info again.relief --json").out)["streams"][0]["bytes_colours"].get<int>(),
            50);
}

TEST_F(CommandLine, PartsOfASceneThatMissTheErrorStayAsTheyAre) {
  SceneBuilder scene;
  scene.mesh({scene.primitive(make_torus(24, 12))}, "pot");
  scene.save(folder / "in.glb");
  Result encoded = run("encode in.glb out.glb --error 1e-9");
  EXPECT_EQ(encoded.code, 0);
  expect_one_line(encoded);
  EXPECT_EQ(read_bytes(folder / "in.glb"), read_bytes(folder / "out.glb"));
}

TEST_F(CommandLine, HelpTeaches) {
  EXPECT_EQ(run("--help").code, 0);
  EXPECT_EQ(run("--version").out.rfind("relief ", 0), 0u);
  for (const char* command : {"encode", "decode", "compare", "info"}) {
    Result help = run(std::string(command) + " --help");
    EXPECT_EQ(help.code, 0);
    EXPECT_NE(help.out.find(std::string("  relief ") + command + " "), std::string::npos) << command;
  }
}

TEST_F(CommandLine, WrongCommandLines) {
  for (const char* arguments : {"",
                                "squash a b",
                                "encode",
                                "encode torus.ply",
                                "encode torus.ply out.stl",
                                "encode torus.ply out",
                                "encode torus.ply t.glb --error 0",
                                "encode torus.ply t.glb --error -1",
                                "encode torus.ply t.glb --error x",
                                "encode torus.ply t.glb --bytes 100 --bpv 1",
                                "encode torus.ply t.glb --error 1e-4 --bytes 100",
                                "encode torus.ply t.glb --threads 0",
                                "encode torus.ply t.glb --coder zip",
                                "encode torus.ply t.glb --allocation odd",
                                "encode torus.ply t.glb --aperture 90",
                                "encode torus.ply t.glb --partition kmeans",
                                "encode torus.ply t.glb --plane best",
                                "encode torus.ply t.glb --density 0",
                                "encode torus.ply t.glb --frobnicate",
                                "decode a.glb out.stl",
                                "compare torus.ply",
                                "info",
                                "compare torus.ply torus.ply --heatmap h.png"}) {
    Result result = run(arguments);
    EXPECT_EQ(result.code, 2) << arguments << ": " << result.err;
    expect_one_line(result);
  }
  EXPECT_EQ(folder.names(), std::vector<std::string>{"torus.ply"});
}

// --- Bad input
// -----------------------------------------------------------------------------------------------------

std::string ply_text(const std::string& vertices, int vertex_count, const std::string& faces,
                     int face_count) {
  return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(vertex_count) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
         std::to_string(face_count) + "\nproperty list uchar int vertex_indices\nend_header\n" + vertices +
         faces;
}

TEST_F(CommandLine, InputsThatCannotWork) {
  std::string triangle = "0 0 0\n1 0 0\n0 1 0\n";
  std::map<std::string, std::string> files = {
      {"unknown.xyzzy", "hello"},
      {"nothing.ply", ""},
      {"empty.ply", ply_text("", 0, "", 0)},
      {"nan.ply", ply_text("0 0 0\n1 nan 0\n0 1 0\n", 3, "3 0 1 2\n", 1)},
      {"infinite.ply", ply_text("0 0 0\n1 inf 0\n0 1 0\n", 3, "3 0 1 2\n", 1)},
      {"range.ply", ply_text(triangle, 3, "3 0 1 3\n", 1)},
      {"negative.ply", ply_text(triangle, 3, "3 0 1 -1\n", 1)},
      {"flat.ply", ply_text("0 0 0\n1 0 0\n2 0 0\n", 3, "3 0 1 2\n", 1)},
      {"point.ply", ply_text("1 1 1\n1 1 1\n1 1 1\n", 3, "3 0 1 2\n", 1)},
      {"short.ply", ply_text("0 0 0\n1 0 0\n", 3, "", 1)},
      {"text.glb", "not a GLB at all, but long enough"},
      {"text.gltf", "{"},
      {"text.obj", "v 1 2\nf 1 2 3\n"},
      {"range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"},
      {"text.off", "OFF\n3 1\n"},
      {"text.stl", "solid x\nfacet"},
      {"text.relief", "RLF?"}};
  for (const auto& [name, text] : files) {
    write_text(folder / name, text);
    for (const char* out : {"out.glb", "out.gltf", "out.relief"}) {
      Result result = run("encode " + name + " " + out);
      EXPECT_EQ(result.code, 1) << name << ": " << result.err;
      expect_one_line(result);
      EXPECT_EQ(result.err.rfind("relief: " + name + ": ", 0), 0u) << result.err;
      EXPECT_FALSE(exists(out));
    }
    Result compared = run("compare torus.ply " + name);
    EXPECT_EQ(compared.code, 1) << name << ": " << compared.err;
    EXPECT_EQ(compared.err.rfind("relief: " + name + ": ", 0), 0u) << compared.err;
    expect_one_line(compared);
  }
  EXPECT_EQ(run("encode missing.ply out.glb").code, 1);
  expect_one_line(run("encode missing.ply out.glb"));
  expect_one_line(run("encode torus.ply no/such/folder/out.glb"));
  for (const char* arguments : {"decode missing.glb out.ply", "decode text.glb out.ply",
                                "decode text.relief out.ply", "decode torus.ply out.ply", "info missing.glb",
                                "info text.relief", "info torus.ply", "compare missing.ply torus.ply"}) {
    Result result = run(arguments);
    EXPECT_EQ(result.code, 1) << arguments << ": " << result.err;
    expect_one_line(result);
  }
  EXPECT_FALSE(exists("out.ply"));
  for (const std::string& name : folder.names()) EXPECT_EQ(name.find("tmp"), std::string::npos) << name;
}

// Surfaces that are odd but hold area: encoded, decoded, and near the original.
TEST_F(CommandLine, InputsThatMustWork) {
  TriangleMesh sphere = make_bumpy_sphere(3);
  TriangleMesh soup;  // single triangles, none of which shares a vertex
  for (const auto& t : sphere.triangles) {
    uint32_t n = uint32_t(soup.positions.size());
    for (uint32_t v : t) soup.positions.push_back(sphere.positions[v]);
    soup.triangles.push_back({n, n + 1, n + 2});
  }
  TriangleMesh fin = sphere;  // a third triangle at the first edge
  fin.positions.push_back({2, 2, 2});
  fin.triangles.push_back({fin.triangles[0][0], fin.triangles[0][1], uint32_t(fin.positions.size() - 1)});
  TriangleMesh degenerate = sphere;
  for (uint32_t i = 0; i < 10; i++) degenerate.triangles.push_back({i, i, i + 1});
  TriangleMesh parts = joined(sphere, moved(make_sphere(0, 0.01), 2, 0, 0));
  TriangleMesh lone;
  lone.positions = {{3, 0, 0}, {3.1f, 0, 0}, {3, 0.1f, 0}};
  lone.triangles = {{0, 1, 2}};
  std::map<std::string, TriangleMesh> meshes = {{"soup", soup},
                                                {"fin", fin},
                                                {"degenerate", degenerate},
                                                {"parts", parts},
                                                {"lone", joined(sphere, lone)}};
  for (const auto& [name, mesh] : meshes) {
    write_text(folder / (name + ".ply"), ply_of(mesh));
    Result encoded = run("encode " + name + ".ply out.glb --error 5e-3 --json");
    ASSERT_EQ(encoded.code, 0) << name << ": " << encoded.err;
    Result compared = run("compare " + name + ".ply out.glb --samples 50000 --json");
    ASSERT_EQ(compared.code, 0) << compared.err;
    EXPECT_LE(compared.json()["e_rms"].get<double>(), 55) << name;
  }
}

// A mesh of one triangle: works, or one line says why not.
TEST_F(CommandLine, ThreeVertices) {
  write_text(folder / "three.ply", ply_text("0 0 0\n1 0 0\n0 1 0\n", 3, "3 0 1 2\n", 1));
  Result result = run("encode three.ply out.glb --json");
  if (result.code == 1) {
    expect_one_line(result);
    EXPECT_FALSE(exists("out.glb"));
  } else {
    EXPECT_TRUE(result.code == 0 || result.code == 3) << result.code << result.err;
    EXPECT_EQ(run("decode out.glb out.ply --quiet").code, 0);
  }
}

TEST_F(CommandLine, TruncatedAndAlteredGlbs) {
  ASSERT_EQ(run("encode torus.ply good.glb --error 5e-3 --quiet").code, 0);
  TestBytes good = read_bytes(folder / "good.glb");
  size_t refused = 0;
  for (size_t size = 0; size < good.size(); size += good.size() / 40 + 1) {
    write_bytes(folder / "bad.glb", TestBytes(good.begin(), good.begin() + ptrdiff_t(size)));
    Result result = run("decode bad.glb bad.ply");
    EXPECT_EQ(result.code, 1) << size;
    expect_one_line(result);
    EXPECT_FALSE(exists("bad.ply"));
  }
  for (size_t i = 0; i < good.size(); i += good.size() / 60 + 1) {
    TestBytes bad = good;
    bad[i] ^= 0x55;
    write_bytes(folder / "bad.glb", bad);
    Result result = run("decode bad.glb bad.ply --quiet");
    EXPECT_TRUE(result.code == 0 || result.code == 1) << i << ": " << result.code << result.err;
    EXPECT_EQ(exists("bad.ply"), result.code == 0);
    if (result.code == 1) expect_one_line(result), refused++;
    std::filesystem::remove(folder / "bad.ply");
  }
  EXPECT_GT(refused, 0u);
}

}  // namespace
}  // namespace relief
