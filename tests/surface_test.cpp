// Readers and writers (surface/import.h) and the half-edge surface (surface/surface.h).
#include "surface/surface.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>

#include "measure/topology.h"
#include "shapes.h"
#include "surface/border.h"
#include "surface/import.h"
#include "surface/readers.h"

namespace relief {
namespace {

// A folder of this process' own, gone at its end.
struct TemporaryFolder {
  std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("relief_surface_test." + std::to_string(getpid()));
  TemporaryFolder() { std::filesystem::create_directories(path); }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};

std::string temporary(const std::string& name) {
  static TemporaryFolder folder;
  return (folder.path / name).string();
}

std::string write_text(const std::string& name, const std::string& bytes) {
  std::string path = temporary(name);
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

// The message of the InputError that `action` throws.
template <class Action>
std::string error_of(Action action) {
  try {
    action();
  } catch (const InputError& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    return e.what();
  }
  ADD_FAILURE() << "no InputError";
  return "";
}

#define EXPECT_CONTAINS(text, part) EXPECT_NE((text).find(part), std::string::npos) << "in: " << (text)

void expect_equal(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.normals, b.normals);
}

// Awkward values that text must bring back exactly.
TriangleMesh awkward_mesh() {
  TriangleMesh mesh = make_waves(6);
  mesh.positions[0] = {0.1f, -1e-38f, 3.4e38f};
  mesh.positions[1] = {1.0f / 3, 16777217.0f, -0.0f};
  return mesh;
}

TriangleMesh with_normals(TriangleMesh mesh) {
  for (size_t i = 0; i < mesh.positions.size(); i++)
    mesh.normals.push_back({float(i % 3 == 0), float(i % 3 == 1), -float(i % 3 == 2)});
  return mesh;
}

template <class T>
void append(std::string& bytes, T value, bool big) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if (big) std::reverse(raw, raw + sizeof(T));
  bytes.append(raw, sizeof(T));
}

// A PLY with properties to skip, doubles, odd index types and an element between vertices and faces.
std::string awkward_ply(const TriangleMesh& mesh, const std::string& format) {
  std::string out =
      "ply\nformat " + format + " 1.0\ncomment a b c\nobj_info x\nelement vertex " +
      std::to_string(mesh.positions.size()) +
      "\nproperty uchar red\nproperty double x\nproperty float y\nproperty list uchar short tags\n"
      "property float z\nelement edge 2\nproperty int vertex1\nproperty int vertex2\nelement face " +
      std::to_string(mesh.triangles.size()) +
      "\nproperty list ushort int vertex_index\nproperty float quality\nend_header\n";
  if (format == "ascii") {
    for (const auto& p : mesh.positions) {
      char line[128];
      std::snprintf(line, sizeof(line), "255 %.9g %+.9g 2 -7 8 %.9g\r\n", p[0], p[1], p[2]);
      out += line;
    }
    out += "0 1\n1 2\n";
    for (const auto& t : mesh.triangles)
      out +=
          "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + "\t" + std::to_string(t[2]) + " 0.5\n";
    return out;
  }
  bool big = format == "binary_big_endian";
  for (const auto& p : mesh.positions) {
    append<uint8_t>(out, 255, big);
    append<double>(out, p[0], big);
    append<float>(out, p[1], big);
    append<uint8_t>(out, 2, big);
    append<int16_t>(out, -7, big);
    append<int16_t>(out, 8, big);
    append<float>(out, p[2], big);
  }
  for (int i : {0, 1, 1, 2}) append<int32_t>(out, i, big);
  for (const auto& t : mesh.triangles) {
    append<uint16_t>(out, 3, big);
    for (uint32_t v : t) append<int32_t>(out, int32_t(v), big);
    append<float>(out, 0.5f, big);
  }
  return out;
}

std::string off_text(const TriangleMesh& mesh) {
  std::string out = "OFF # a comment\n# another\n" + std::to_string(mesh.positions.size()) + " " +
                    std::to_string(mesh.triangles.size()) + " 0\n";
  char line[128];
  for (const auto& p : mesh.positions) {
    std::snprintf(line, sizeof(line), "%.9g %.9g %.9g\n", p[0], p[1], p[2]);
    out += line;
  }
  for (const auto& t : mesh.triangles) {
    std::snprintf(line, sizeof(line), "3 %u %u %u 255 0 0\n", t[0], t[1], t[2]);
    out += line;
  }
  return out;
}

std::string stl_ascii(const TriangleMesh& mesh) {
  std::string out = "solid a facet of life\n";
  for (const auto& t : mesh.triangles) {
    out += "  facet normal 0 0 1\n    outer loop\n";
    for (uint32_t v : t) {
      char line[128];
      const auto& p = mesh.positions[v];
      std::snprintf(line, sizeof(line), "      vertex %.9g %.9g %.9g\n", p[0], p[1], p[2]);
      out += line;
    }
    out += "    endloop\n  endfacet\n";
  }
  return out + "endsolid a facet of life\n";
}

std::string stl_binary(const TriangleMesh& mesh) {
  std::string out = "solid, but binary";
  out.resize(80, ' ');
  append<uint32_t>(out, uint32_t(mesh.triangles.size()), false);
  for (const auto& t : mesh.triangles) {
    out.append(12, '\0');
    for (uint32_t v : t)
      for (float c : mesh.positions[v]) append(out, c, false);
    out.append(2, '\0');
  }
  return out;
}

// STL numbers vertices in the order of the triangles; the corners must be the same.
void expect_same_corners(const TriangleMesh& a, const TriangleMesh& b) {
  ASSERT_EQ(a.positions.size(), b.positions.size());
  ASSERT_EQ(a.triangles.size(), b.triangles.size());
  for (size_t t = 0; t < a.triangles.size(); t++)
    for (int k = 0; k < 3; k++) ASSERT_EQ(a.positions[a.triangles[t][k]], b.positions[b.triangles[t][k]]);
}

TEST(ReadMesh, PlyOfEveryEncodingComesBackExactly) {
  TriangleMesh mesh = awkward_mesh();
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    SCOPED_TRACE(format);
    expect_equal(read_mesh(write_text("awkward.ply", awkward_ply(mesh, format))), mesh);
  }
}

TEST(ReadMesh, OffAndObjAndStlComeBackExactly) {
  TriangleMesh mesh = awkward_mesh();
  expect_equal(read_mesh(write_text("mesh.off", off_text(mesh))), mesh);
  write_mesh(temporary("mesh.obj"), mesh);
  expect_equal(read_mesh(temporary("mesh.obj")), mesh);
  mesh = make_torus(12, 8);
  expect_same_corners(read_mesh(write_text("a.STL", stl_ascii(mesh))), mesh);
  expect_same_corners(read_mesh(write_text("b.stl", stl_binary(mesh))), mesh);
}

TEST(WriteMesh, EveryFormatComesBackExactly) {
  for (const TriangleMesh& mesh : {make_sphere(2), with_normals(make_hemisphere(4, 9))})
    for (const char* name : {"written.ply", "written.obj", "written.glb"}) {
      SCOPED_TRACE(name);
      write_mesh(temporary(name), mesh);
      expect_equal(read_mesh(temporary(name)), mesh);
    }
}

TEST(WriteMesh, LeavesNothingBehindWhenItFails) {
  std::string missing = temporary("missing_folder/x.ply");
  EXPECT_CONTAINS(error_of([&] { write_mesh(missing, make_sphere(0)); }), "cannot be written");
  std::string folder = temporary("folder.ply");
  std::filesystem::create_directories(folder + "/full");
  EXPECT_CONTAINS(error_of([&] { write_mesh(folder, make_sphere(0)); }), "cannot be written");
  for (const auto& entry : std::filesystem::directory_iterator(temporary("")))
    EXPECT_EQ(entry.path().string().find(".tmp"), std::string::npos) << entry.path();
  EXPECT_CONTAINS(error_of([&] { write_mesh(temporary("x.abc"), make_sphere(0)); }), "unknown format '.abc'");
  EXPECT_CONTAINS(error_of([&] { write_mesh(temporary("x.ply"), TriangleMesh()); }), "no triangles");
}

TEST(ReadMesh, SplitsPolygonsAndSkipsLines) {
  TriangleMesh mesh =
      read_off("OFF\n5 3 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n5 0 1 2 3 4\n2 0 1\n3 2 3 4\n");
  std::vector<std::array<uint32_t, 3>> expected = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {2, 3, 4}};
  EXPECT_EQ(mesh.triangles, expected);
}

TEST(ReadMesh, ObjIndicesMayBeNegativeSlashedAndContinued) {
  TriangleMesh mesh = read_obj(
      "# c\nmtllib x.mtl\no a\nv 0 0 0\nv 1 0 0 1.0\nv 0 1 0\nvt 0 0\nvn 0 0 1\ns off\n"
      "f 1/1/1 2/1/1 3/1/1\nv 0 0 1\nf -4 \\\n -3 -1\nf 2//1 3//1 4//1");
  std::vector<std::array<uint32_t, 3>> expected = {{0, 1, 2}, {0, 1, 3}, {1, 2, 3}};
  EXPECT_EQ(mesh.triangles, expected);
  EXPECT_TRUE(mesh.normals.empty()) << "one face gives no normals";
}

TEST(ReadMesh, ObjKeepsNormalsThatBelongToVertices) {
  TriangleMesh mesh = read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 1 0 0\nvn 0 1 0\nvn 0 0 1\nf 1//3 2//2 3//1\n");
  std::vector<std::array<float, 3>> expected = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}};
  EXPECT_EQ(mesh.normals, expected);
}

TEST(ReadObj, ColoursBehindTheCoordinates) {
  using Colours = std::vector<std::array<uint8_t, 4>>;
  const std::string face = "f 1 2 3\n";
  EXPECT_EQ(read_obj("v 0 0 0 1 0 0.5\nv 1 0 0 0 0 0\nv 0 1 0 0 1 2e-3\n" + face).colors,
            (Colours{{255, 0, 128, 255}, {0, 0, 0, 255}, {0, 255, 1, 255}}));
  EXPECT_EQ(read_obj("v 0 0 0 255 0 8\nv 1 0 0 -3 0 0\nv 0 1 0 999 1 2\n" + face).colors,
            (Colours{{255, 0, 8, 255}, {0, 0, 0, 255}, {255, 1, 2, 255}}));
  EXPECT_TRUE(read_obj("v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\n" + face).colors.empty());        // weights
  EXPECT_TRUE(read_obj("v 0 0 0 1 1 1\nv 1 0 0\nv 0 1 0 0 0 0\n" + face).colors.empty());  // not all
}

TEST(WriteMesh, ColoursComeBack) {
  TriangleMesh mesh = make_sphere(1);
  for (size_t i = 0; i < mesh.positions.size(); i++)
    mesh.colors.push_back({uint8_t(i), uint8_t(255 - i), uint8_t(3 * i), 255});
  for (const char* name : {"colours.ply", "colours.obj", "colours.glb"}) {
    write_mesh(temporary(name), mesh);
    EXPECT_EQ(read_mesh(temporary(name)).colors, mesh.colors) << name;
  }
}

TEST(ReadMesh, OffKindsWithColoursAndNormals) {
  TriangleMesh mesh = read_off("CNOFF\n3 1 0\n0 0 0 0 0 1 255 0 0 255\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n");
  EXPECT_EQ(mesh.normals.size(), 3u);
  EXPECT_EQ(mesh.normals[1], (std::array<float, 3>{0, 0, 1}));
  EXPECT_CONTAINS(error_of([] { read_off("4OFF\n1 1 1\n"); }), "4OFF");
  EXPECT_CONTAINS(error_of([] { read_off("OFF BINARY\n"); }), "binary");
}

TEST(ReadMesh, SaysWhatIsWrongWithAFile) {
  EXPECT_CONTAINS(error_of([] { read_mesh("/nowhere/x.ply"); }), "cannot be opened: No such file");
  EXPECT_CONTAINS(error_of([] { read_mesh(write_text("x.doc", "1")); }), "unknown format '.doc'");
  EXPECT_CONTAINS(error_of([] { read_mesh(write_text("noextension", "1")); }), "unknown format ''");
  std::filesystem::create_directories(temporary("d.ply"));
  EXPECT_CONTAINS(error_of([] { read_mesh(temporary("d.ply")); }), "folder");
  for (const char* name : {"e.ply", "e.obj", "e.off", "e.stl"})
    EXPECT_CONTAINS(error_of([&] { read_mesh(write_text(name, "")); }), "empty file");
}

TEST(ReadMesh, MeshesWithoutVerticesOrFaces) {
  auto ply = [](const std::string& vertices, const std::string& data) {
    return "ply\nformat ascii 1.0\nelement vertex " + vertices +
           "\nproperty float x\nproperty float y\nproperty float z\nelement face 0\n"
           "property list uchar int vertex_indices\nend_header\n" +
           data;
  };
  EXPECT_CONTAINS(error_of([&] { read_mesh(write_text("a.ply", ply("0", ""))); }), "no vertices");
  EXPECT_EQ(read_mesh(write_text("a.ply", ply("1", "1 2 3\n"))).positions.size(), 1u);  // a point cloud
  EXPECT_CONTAINS(error_of([&] { read_mesh(write_text("a.obj", "# nothing\n")); }), "no vertices");
  EXPECT_CONTAINS(error_of([&] { read_mesh(write_text("a.obj", "v 1 2 3\n")); }), "no faces");
  EXPECT_CONTAINS(error_of([&] { read_mesh(write_text("a.off", "OFF\n0 0 0\n")); }), "no vertices");
  EXPECT_CONTAINS(error_of([&] { read_mesh(write_text("a.off", "OFF\n1 0 0\n1 2 3\n")); }), "no faces");
  EXPECT_CONTAINS(error_of([&] { read_mesh(write_text("a.stl", "solid\nendsolid\n")); }), "no vertices");
}

TEST(ReadMesh, CoordinatesThatAreNotFinite) {
  auto off = [](const char* value) {
    return write_text("bad.off", std::string("OFF\n3 1 0\n0 0 0\n1 0 0\n0 ") + value + " 0\n3 0 1 2\n");
  };
  EXPECT_CONTAINS(error_of([&] { read_mesh(off("nan")); }), "vertex 2 has a coordinate that is not a number");
  EXPECT_CONTAINS(error_of([&] { read_mesh(off("-inf")); }), "vertex 2 has a coordinate that is infinite");
  EXPECT_CONTAINS(error_of([&] { read_mesh(off("1e99")); }), "vertex 2 has a coordinate that is infinite");
  EXPECT_EQ(read_mesh(off("1e-99")).positions[2][1], 0.0f);
  TriangleMesh mesh = make_sphere(1);
  mesh.positions[5][2] = std::numeric_limits<float>::quiet_NaN();
  for (const char* format : {"binary_little_endian", "binary_big_endian", "ascii"})
    EXPECT_CONTAINS(error_of([&] { read_mesh(write_text("bad.ply", awkward_ply(mesh, format))); }),
                    "vertex 5 ");
  EXPECT_CONTAINS(error_of([&] { read_mesh(write_text("bad.stl", stl_binary(mesh))); }), "not finite");
  EXPECT_CONTAINS(error_of([&] { build_surface(mesh); }), "vertex 5 ");
}

TEST(ReadMesh, IndicesOutOfRange) {
  EXPECT_CONTAINS(error_of([] { read_off("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 3\n"); }),
                  "face 1: vertex index 3 is out of range (3 vertices)");
  EXPECT_CONTAINS(error_of([] { read_off("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"); }),
                  "face 0: vertex index -1");
  std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  EXPECT_CONTAINS(error_of([&] { read_obj(obj + "f 1 2 4\n"); }), "face 1: vertex index 4 is out of range");
  EXPECT_CONTAINS(error_of([&] { read_obj(obj + "f 1 2 0\n"); }), "face 1: vertex index 0 is out of range");
  EXPECT_CONTAINS(error_of([&] { read_obj(obj + "f 1 2 -4\n"); }), "face 1: vertex index -4 is out of range");
  EXPECT_CONTAINS(error_of([&] { read_obj(obj + "f 1 2 99999999999999999999\n"); }),
                  "line 5: expected an integer");
  TriangleMesh mesh = make_sphere(1);
  mesh.triangles[7][1] = 42;
  for (const char* format : {"binary_little_endian", "binary_big_endian", "ascii"})
    EXPECT_CONTAINS(error_of([&] { read_ply(awkward_ply(mesh, format)); }),
                    "face 7: vertex index 42 is out of range");
  EXPECT_CONTAINS(error_of([&] { build_surface(mesh); }), "face 7: vertex index 42");
}

TEST(ReadMesh, TextThatIsNoNumberNamesItsLine) {
  EXPECT_CONTAINS(error_of([] { read_obj("v 0 0 0\nv 1 zwei 3\n"); }),
                  "line 2: expected a number, found 'zwei'");
  EXPECT_CONTAINS(error_of([] { read_obj("v 0 0\n"); }), "line 1: the line ends where a number should be");
  EXPECT_CONTAINS(error_of([] { read_off("OFF\n1 1 0\n1 2 3x4\n3 0 0 0\n"); }), "line 3: expected a number");
  EXPECT_CONTAINS(error_of([] { read_stl("solid\nfacet normal 0 0 1\nouter loop\nvertices"); }),
                  "line 4: expected");
  EXPECT_CONTAINS(error_of([] { read_ply("ply\nformat ascii 2\nelement vertex 1\nproperty half x\n"); }),
                  "'half'");
  EXPECT_CONTAINS(error_of([] { read_ply("ply\nformat utf8 1.0\n"); }), "unknown PLY format 'utf8'");
  EXPECT_CONTAINS(error_of([] { read_ply("plx\n"); }), "not a PLY");
}

// Counts that no memory could hold must fail by the size of the file, before anything is allocated.
TEST(ReadMesh, CountsBeyondTheFile) {
  for (const char* format : {"ascii", "binary_little_endian"})
    for (const char* counts :
         {"4000000000 1", "3 4000000000", "3 18446744073709551615", "3 -1", "99999999999 1"}) {
      std::string vertices(counts, std::strchr(counts, ' ')), faces(std::strchr(counts, ' ') + 1);
      std::string text =
          std::string("ply\nformat ") + format + " 1.0\nelement vertex " + vertices +
          "\nproperty float x\nproperty float y\nproperty float z\nelement face " + faces +
          "\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0 0000000000000\n";
      error_of([&] { read_ply(text); });
    }
  EXPECT_CONTAINS(error_of([] { read_off("OFF\n4000000000 1 0\n0 0 0\n"); }), "too short");
  EXPECT_CONTAINS(error_of([] { read_off("OFF\n1 4000000000 0\n0 0 0\n"); }), "too short");
  std::string stl(84, '\xff');
  EXPECT_CONTAINS(error_of([&] { read_stl(stl); }), "too short for its 4294967295 triangles");
}

// For two points, with fields that nobody knows.
std::string pcd_header(const std::string& kind, const std::string& points = "2") {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS rgb x y z label normal_x normal_y normal_z\nSIZE 4 4 4 4 2 4 4 8\n"
         "TYPE U F F F U F F F\nCOUNT 1 1 1 1 3 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
         points + "\nDATA " + kind + "\n";
}

// Every prefix fails or is a mesh of valid indices; binary files and files cut before the last line always
// fail.
TEST(ReadMesh, EveryPrefixFailsOrIsWellFormed) {
  TriangleMesh mesh = make_sphere(1);
  struct Case {
    const char* name;
    TriangleMesh (*read)(std::string_view);
    std::string bytes;
    bool always_fails;  // until the last few bytes, which may be blanks or digits
  };
  write_mesh(temporary("prefix.obj"), mesh);
  std::ifstream obj(temporary("prefix.obj"), std::ios::binary);
  Case cases[] = {{"ply ascii", read_ply, awkward_ply(mesh, "ascii"), true},
                  {"ply little", read_ply, awkward_ply(mesh, "binary_little_endian"), true},
                  {"ply big", read_ply, awkward_ply(mesh, "binary_big_endian"), true},
                  {"off", read_off, off_text(mesh), true},
                  {"stl ascii", read_stl, stl_ascii(mesh), true},
                  {"stl binary", read_stl, stl_binary(mesh), true},
                  {"pcd", read_pcd,
                   pcd_header("ascii") + "1 1 2 3 0 1 2 0 0.6 0.8 16744512 1 2 3 0 1 2 0 0.6 0.8\n", true},
                  {"obj", read_obj, std::string(std::istreambuf_iterator<char>(obj), {}), false}};
  for (const Case& c : cases)
    for (size_t size = 0; size < c.bytes.size(); size++) {
      // a copy of exactly this size, so that a sanitizer sees reads behind it
      std::vector<char> prefix(c.bytes.begin(), c.bytes.begin() + std::ptrdiff_t(size));
      try {
        TriangleMesh part = c.read({prefix.data(), prefix.size()});
        EXPECT_FALSE(c.always_fails && size + 27 < c.bytes.size()) << c.name << " of " << size << " bytes";
        for (const auto& t : part.triangles)
          for (uint32_t v : t) ASSERT_LT(v, part.positions.size()) << c.name << " of " << size << " bytes";
      } catch (const InputError&) {
      }
    }
}

TEST(ReadPoints, PlyKeepsNormalsAndColours) {
  TriangleMesh cloud = with_normals(make_sphere(1));
  cloud.triangles.clear();
  for (size_t i = 0; i < cloud.positions.size(); i++)
    cloud.colors.push_back({uint8_t(i), uint8_t(255 - i), 7, uint8_t(100 + i)});
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(cloud.positions.size()) +
      "\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n"
      "property float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\n"
      "property float nz\nend_header\n";
  for (size_t i = 0; i < cloud.positions.size(); i++) {
    for (uint8_t c : cloud.colors[i]) bytes += char(c);
    for (float c : cloud.positions[i]) append(bytes, c, false);
    for (float c : cloud.normals[i]) append(bytes, c, false);
  }
  const TriangleMesh read = read_mesh(write_text("cloud.ply", bytes));
  expect_equal(read, cloud);
  EXPECT_EQ(read.colors, cloud.colors);
  for (const char* name : {"cloud2.ply", "cloud2.xyz"}) {
    write_points(temporary(name), cloud);
    expect_equal(read_mesh(temporary(name)), cloud);
  }
}

TEST(ReadPoints, XyzOfThreeSixAndNineColumns) {
  using Vector = std::array<float, 3>;
  using Color = std::array<uint8_t, 4>;
  TriangleMesh cloud = read_xyz("# x y z\n1 2 3\n\n 4\t5 6e0\n");
  EXPECT_EQ(cloud.positions, (std::vector<Vector>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_TRUE(cloud.normals.empty() && cloud.colors.empty());
  cloud = read_xyz("1 2 3 0 0.6 -0.8\r\n4 5 6 0 0 1");
  EXPECT_EQ(cloud.normals, (std::vector<Vector>{{0, 0.6f, -0.8f}, {0, 0, 1}}));
  EXPECT_TRUE(cloud.colors.empty());
  cloud = read_xyz("1 2 3 10 20 255\n4 5 6 0 0 1");  // no vector of unit length
  EXPECT_EQ(cloud.colors, (std::vector<Color>{{10, 20, 255, 255}, {0, 0, 1, 255}}));
  EXPECT_TRUE(cloud.normals.empty());
  cloud = read_xyz("1 2 3 0 0 1 10 20 30\n");
  EXPECT_EQ(cloud.normals, (std::vector<Vector>{{0, 0, 1}}));
  EXPECT_EQ(cloud.colors, (std::vector<Color>{{10, 20, 30, 255}}));
  EXPECT_CONTAINS(error_of([] { read_xyz("1 2 3\n1 2\n"); }), "line 2: expected 3, 6 or 9 numbers, found 2");
  EXPECT_CONTAINS(error_of([] { read_xyz("1 2 3\n1 2 3 0 0 1\n"); }),
                  "line 2: expected 3 numbers as before, found 6");
  EXPECT_CONTAINS(error_of([] { read_xyz("1 2 3 0 0 1 0 0 256\n"); }), "line 1: a colour beyond 0 to 255");
  EXPECT_CONTAINS(error_of([] { read_xyz("1 2 3 4 5 6 7 8 9 10\n"); }), "line 1: more than 9 numbers");
  EXPECT_CONTAINS(error_of([] { read_xyz("1 2 three\n"); }), "line 1: expected a number, found 'three'");
  EXPECT_CONTAINS(error_of([] { read_mesh(write_text("a.xyz", "1 2 nan\n")); }), "vertex 0 has a coordinate");
  EXPECT_CONTAINS(error_of([] { read_mesh(write_text("a.xyz", "# nothing\n")); }), "no vertices");
}

TEST(ReadPoints, PcdAsciiAndBinary) {
  std::string binary = pcd_header("binary");
  for (int i = 0; i < 2; i++) {
    append(binary, uint32_t(0xff8040), false);
    for (float c : {1.0f, i ? std::numeric_limits<float>::quiet_NaN() : 2.0f, 3.0f}) append(binary, c, false);
    for (int k = 0; k < 3; k++) append(binary, uint16_t(k), false);
    append(binary, 0.0f, false), append(binary, 0.6f, false), append(binary, double(0.8f), false);
  }
  for (const std::string& bytes :
       {pcd_header("ascii") + "16744512 1 2 3 0 1 2 0 0.6 0.8\n16744512 1 nan 3 0 1 2 0 0.6 0.8\n", binary}) {
    const TriangleMesh cloud = read_mesh(write_text("a.pcd", bytes));
    EXPECT_EQ(cloud.positions, (std::vector<std::array<float, 3>>{{1, 2, 3}}));
    EXPECT_EQ(cloud.normals, (std::vector<std::array<float, 3>>{{0, 0.6f, 0.8f}}));
    EXPECT_EQ(cloud.colors, (std::vector<std::array<uint8_t, 4>>{{255, 128, 64, 255}}));
  }
  binary.pop_back();
  EXPECT_CONTAINS(error_of([&] { read_pcd(binary); }), "too short for its 2 points");
  EXPECT_CONTAINS(error_of([] { read_pcd(pcd_header("ascii", "4000000000") + "1 2 3\n"); }), "too short");
  EXPECT_CONTAINS(error_of([] { read_pcd(pcd_header("ascii", "-1")); }), "line 11: the number of points");
  EXPECT_CONTAINS(error_of([] { read_pcd(pcd_header("binary_compressed")); }),
                  "'binary_compressed' cannot be read");
  EXPECT_CONTAINS(error_of([] { read_pcd("FIELDS x y\nSIZE 4 4\nTYPE F F\nPOINTS 1\nDATA ascii\n1 2\n"); }),
                  "no x, y and z");
  EXPECT_CONTAINS(error_of([] { read_pcd("FIELDS x y z\nSIZE 4 4\n"); }),
                  "fewer words than fields after SIZE");
  EXPECT_CONTAINS(error_of([] { read_pcd("FIELDS x y z\nPOINTS 1\nDATA ascii\n1 2 3"); }), "no SIZE or TYPE");
  EXPECT_CONTAINS(error_of([] { read_pcd("v 1 2 3\n"); }), "not a PCD file");
}

// Random changes must never do worse than throw.
TEST(ReadMesh, ChangedBytesFailOrAreWellFormed) {
  TriangleMesh mesh = make_sphere(1);
  struct Case {
    TriangleMesh (*read)(std::string_view);
    std::string bytes;
  };
  Case cases[] = {{read_ply, awkward_ply(mesh, "ascii")},
                  {read_ply, awkward_ply(mesh, "binary_big_endian")},
                  {read_off, off_text(mesh)},
                  {read_stl, stl_ascii(mesh)},
                  {read_stl, stl_binary(mesh)},
                  {read_obj, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2//1 3\n"}};
  uint32_t random = 1;
  auto next = [&] { return (random = random * 1664525u + 1013904223u) >> 8; };
  size_t failed = 0, read = 0;
  for (const Case& c : cases)
    for (int i = 0; i < 2000; i++) {
      std::string bytes = c.bytes;
      for (uint32_t k = 0; k <= next() % 3; k++) bytes[next() % bytes.size()] = char(next());
      try {
        TriangleMesh changed = c.read(bytes);
        read++;
        for (const auto& t : changed.triangles)
          for (uint32_t v : t) ASSERT_LT(v, changed.positions.size());
      } catch (const InputError&) {
        failed++;
      }
    }
  EXPECT_GT(failed, 0u);
  EXPECT_GT(read, 0u);
}

// What every surface must satisfy: neighbours know each other and run their common edge both ways, fans are
// whole.
void expect_manifold(const Surface& s) {
  ASSERT_EQ(s.adjacent.size(), s.faces.size());
  ASSERT_EQ(s.normals.size(), s.faces.size());
  ASSERT_EQ(s.areas.size(), s.faces.size());
  ASSERT_EQ(s.component.size(), s.faces.size());
  ASSERT_EQ(s.source.size(), s.faces.size());
  double area = 0, component_area = 0;
  TriangleMesh mesh;
  for (const Vec3& v : s.vertices) mesh.positions.push_back({float(v[0]), float(v[1]), float(v[2])});
  for (size_t f = 0; f < s.faces.size(); f++) {
    area += s.areas[f];
    mesh.triangles.push_back({uint32_t(s.faces[f][0]), uint32_t(s.faces[f][1]), uint32_t(s.faces[f][2])});
    for (int k = 0; k < 3; k++) {
      ASSERT_NE(s.faces[f][k], s.faces[f][(k + 1) % 3]);
      int g = s.adjacent[f][k];
      if (g < 0) continue;
      EXPECT_EQ(s.component[f], s.component[g]);
      int back = 0;
      for (int j = 0; j < 3; j++)
        back += s.adjacent[g][j] == int(f) && s.faces[g][j] == s.faces[f][(k + 1) % 3] &&
                s.faces[g][(j + 1) % 3] == s.faces[f][k];
      EXPECT_EQ(back, 1);
    }
  }
  for (double a : s.component_area) component_area += a;
  EXPECT_NEAR(area, s.total_area, 1e-9 * area);
  EXPECT_NEAR(component_area, s.total_area, 1e-9 * area);
  Topology t = topology(mesh);
  EXPECT_EQ(t.nonmanifold_edges, 0u);
  EXPECT_EQ(t.nonmanifold_vertices, 0u);
  EXPECT_EQ(t.components, s.component_area.size());
  EXPECT_EQ(t.vertices, s.vertices.size());
  uint64_t open = 0;
  for (const auto& a : s.adjacent) open += uint64_t(std::count(a.begin(), a.end(), -1));
  EXPECT_EQ(t.open_edges, open);
}

size_t open_edges(const Surface& s) {
  size_t open = 0;
  for (const auto& a : s.adjacent) open += size_t(std::count(a.begin(), a.end(), -1));
  return open;
}

TEST(BuildSurface, KeepsCleanMeshesAsTheyAre) {
  for (const TriangleMesh& mesh :
       {make_sphere(3), make_torus(20, 12), make_cube(4), make_plate(8), make_hemisphere(6, 20),
        make_nested_spheres(2), make_bumpy_sphere(3), make_waves(10)}) {
    Surface s = build_surface(mesh);
    expect_manifold(s);
    EXPECT_TRUE(s.warnings.empty()) << s.warnings[0];
    ASSERT_EQ(s.vertices.size(), mesh.positions.size());
    ASSERT_EQ(s.faces.size(), mesh.triangles.size());
    double worst = 0;
    for (size_t f = 0; f < s.faces.size(); f++) {
      EXPECT_EQ(s.source[f], int(f));
      for (int k = 0; k < 3; k++) EXPECT_EQ(uint32_t(s.faces[f][k]), mesh.triangles[f][k]);
    }
    for (size_t i = 0; i < s.vertices.size(); i++) {
      const auto& p = mesh.positions[i];
      worst = std::max(worst, (s.origin + s.scale * s.vertices[i] - Vec3(p[0], p[1], p[2])).norm());
    }
    EXPECT_LT(worst, 1e-12);
  }
}

TEST(BuildSurface, MeasuresInLatticeUnits) {
  Surface s = build_surface(make_cube(3));
  Vec3 low = s.vertices[0], high = low;
  for (const Vec3& v : s.vertices) low = low.cwiseMin(v), high = high.cwiseMax(v);
  EXPECT_NEAR((high - low).norm(), kLatticeDiagonal, 1e-3);
  EXPECT_NEAR((high + low).norm(), 0, 1e-3);
  EXPECT_NEAR(s.total_area * s.scale * s.scale, 24, 1e-6);
  for (size_t f = 0; f < s.faces.size(); f++) {
    Vec3 centre = (s.vertices[s.faces[f][0]] + s.vertices[s.faces[f][1]] + s.vertices[s.faces[f][2]]) / 3;
    EXPECT_GT(s.normals[f].dot(centre), 0) << "normals point outwards";
    EXPECT_NEAR(s.normals[f].norm(), 1, 1e-12);
  }
}

TEST(BuildSurface, MergesLooseTriangles) {
  TriangleMesh mesh = make_torus(20, 12), loose;
  for (const auto& t : mesh.triangles) {
    loose.triangles.push_back({});
    for (int k = 0; k < 3; k++) {
      loose.triangles.back()[k] = uint32_t(loose.positions.size());
      loose.positions.push_back(mesh.positions[t[k]]);
    }
  }
  loose.positions[0][2] = 0.0f;  // the same place as -0
  Surface s = build_surface(loose);
  expect_manifold(s);
  EXPECT_EQ(s.vertices.size(), mesh.positions.size());
  EXPECT_EQ(s.faces.size(), mesh.triangles.size());
  EXPECT_EQ(open_edges(s), 0u);
}

TEST(BuildSurface, MergesZeroesOfBothSigns) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-0.0f, -0.0f, 0}, {0, -1, 0}, {1, -0.0f, 0}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  Surface s = build_surface(mesh);
  EXPECT_EQ(s.vertices.size(), 4u);
  EXPECT_EQ(s.adjacent[0][0], 1);
}

TEST(BuildSurface, DropsDegenerateAndDuplicateTriangles) {
  TriangleMesh mesh = make_sphere(2);
  size_t count = mesh.triangles.size();
  auto t = mesh.triangles[3];
  mesh.triangles.insert(mesh.triangles.begin(), {t[0], t[0], t[1]});
  mesh.triangles.push_back({t[1], t[2], t[0]});
  mesh.triangles.push_back({t[1], t[0], t[2]});
  Surface s = build_surface(mesh);
  expect_manifold(s);
  EXPECT_EQ(s.faces.size(), count);
  EXPECT_EQ(s.source.front(), 1);
  EXPECT_EQ(open_edges(s), 0u);
  EXPECT_EQ(s.warnings,
            (std::vector<std::string>{"dropped 1 degenerate triangle", "dropped 2 duplicate triangles"}));
}

TEST(BuildSurface, TurnsTrianglesAround) {
  TriangleMesh mesh = make_bumpy_sphere(3);
  size_t turned = 0;
  for (size_t t = 0; t < mesh.triangles.size(); t += 3, turned++)
    std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  Surface s = build_surface(mesh);
  expect_manifold(s);
  EXPECT_EQ(open_edges(s), 0u);
  EXPECT_EQ(s.component_area.size(), 1u);
  double volume = 0;
  for (const auto& f : s.faces) volume += s.vertices[f[0]].dot(s.vertices[f[1]].cross(s.vertices[f[2]])) / 6;
  EXPECT_GT(volume, 0) << "the larger part keeps its side";
  EXPECT_EQ(s.warnings, (std::vector<std::string>{"turned " + std::to_string(turned) + " triangles around"}));
}

TEST(BuildSurface, CutsAMoebiusStrip) {
  TriangleMesh mesh;
  constexpr int n = 30;
  for (int i = 0; i < n; i++)
    for (int side : {-1, 1}) {
      double u = 2 * shapes::kPi * i / n, d = 1 + side * 0.3 * std::cos(u / 2);
      shapes::add(mesh, {d * std::cos(u), d * std::sin(u), side * 0.3 * std::sin(u / 2)});
    }
  for (uint32_t i = 0; i < n; i++) {
    uint32_t a = 2 * i, b = 2 * i + 1, c = i + 1 < n ? 2 * i + 2 : 1, d = i + 1 < n ? 2 * i + 3 : 0;
    shapes::add_quad(mesh, a, c, d, b);
  }
  Surface s = build_surface(mesh);
  expect_manifold(s);
  EXPECT_EQ(s.faces.size(), size_t(2 * n));
  EXPECT_EQ(s.component_area.size(), 1u);
  EXPECT_EQ(open_edges(s), size_t(2 * n + 2)) << "a ribbon: its border and the cut";
  EXPECT_EQ(s.vertices.size(), size_t(2 * n + 2));
}

TEST(BuildSurface, SplitsThreeTrianglesOnAnEdge) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0.1f, 1, 0}, {-1, -0.1f, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}};
  Surface s = build_surface(mesh);
  expect_manifold(s);
  EXPECT_EQ(s.faces.size(), 3u);
  EXPECT_EQ(s.component_area.size(), 2u);
  EXPECT_EQ(s.vertices.size(), 7u);
  EXPECT_EQ(s.component[0], s.component[2]) << "the two that bend least stay together";
  EXPECT_EQ(s.warnings,
            (std::vector<std::string>{"split 1 non-manifold edge", "split 2 non-manifold vertices"}));
}

TEST(BuildSurface, AFinLeavesTheSheetWhole) {
  TriangleMesh sheet = make_waves(10);
  size_t count = sheet.triangles.size();
  auto inner = sheet.triangles[97];
  sheet.triangles.insert(sheet.triangles.begin(), {inner[1], inner[0], uint32_t(sheet.positions.size())});
  sheet.positions.push_back({0.1f, 0.2f, 1});
  Surface s = build_surface(sheet);
  expect_manifold(s);
  EXPECT_EQ(s.component_area.size(), 2u);
  EXPECT_EQ(open_edges(s), 40u + 3);
  EXPECT_EQ(s.faces.size(), count + 1);
}

// Two closed boxes that share an edge: four triangles on each of its pieces, yet both come back closed.
TEST(BuildSurface, SeparatesSolidsThatTouchAlongAnEdge) {
  TriangleMesh box = make_cube(2);
  Surface s = build_surface(joined(box, moved(box, 2, 2, 0)));
  expect_manifold(s);
  EXPECT_EQ(s.component_area.size(), 2u);
  EXPECT_EQ(open_edges(s), 0u);
  EXPECT_EQ(s.vertices.size(), 2 * box.positions.size());
}

TEST(BuildSurface, SplitsABowTieVertex) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 3, 4}};
  Surface s = build_surface(mesh);
  expect_manifold(s);
  EXPECT_EQ(s.component_area.size(), 2u);
  EXPECT_EQ(s.vertices.size(), 6u);
  TriangleMesh spheres = joined(scaled(make_sphere(2), 1), TriangleMesh());
  TriangleMesh other = make_sphere(2);
  auto touch = spheres.positions[7];
  for (auto& p : other.positions) p = {2 * touch[0] - p[0], 2 * touch[1] - p[1], 2 * touch[2] - p[2]};
  s = build_surface(joined(spheres, flipped(other)));
  expect_manifold(s);
  EXPECT_EQ(s.component_area.size(), 2u);
  EXPECT_EQ(open_edges(s), 0u);
}

TEST(BuildSurface, SingleTriangleAndManyComponents) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  Surface s = build_surface(mesh);
  expect_manifold(s);
  EXPECT_EQ(open_edges(s), 3u);
  TriangleMesh many = mesh;
  for (int i = 1; i < 500; i++) many = joined(many, moved(mesh, i * 1.5, i % 7, i % 3));
  s = build_surface(many);
  expect_manifold(s);
  EXPECT_EQ(s.component_area.size(), 500u);
}

TEST(BuildSurface, TrianglesWithoutAreaStayAndHaveNoNormal) {
  TriangleMesh mesh;  // a square whose side has a vertex more, closed by a flat triangle
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5f, 0, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 4, 1}};
  Surface s = build_surface(mesh);
  expect_manifold(s);
  ASSERT_EQ(s.faces.size(), 3u);
  EXPECT_EQ(s.areas[2], 0);
  EXPECT_EQ(s.normals[2], Vec3(0, 0, 0));
  EXPECT_EQ(s.component_area.size(), 1u);
  EXPECT_EQ(s.warnings, (std::vector<std::string>{"found 1 triangle without area"}));
}

TEST(BuildSurface, RefusesMeshesWithoutArea) {
  TriangleMesh mesh;
  EXPECT_CONTAINS(error_of([&] { build_surface(mesh); }), "no vertices");
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  EXPECT_CONTAINS(error_of([&] { build_surface(mesh); }), "no faces");
  mesh.triangles = {{0, 1, 2}};
  EXPECT_CONTAINS(error_of([&] { build_surface(mesh); }), "no triangle of positive area");
  mesh.triangles = {{0, 0, 1}};
  EXPECT_CONTAINS(error_of([&] { build_surface(mesh); }), "no triangle of positive area");
  mesh.positions = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_CONTAINS(error_of([&] { build_surface(mesh); }), "no triangle of positive area");
}

// Random triangles on few vertices: as non-manifold as can be. Whatever comes out is manifold and nothing is
// lost.
TEST(BuildSurface, RandomSoupBecomesManifold) {
  uint32_t random = 7;
  auto next = [&](uint32_t n) { return ((random = random * 1664525u + 1013904223u) >> 8) % n; };
  for (int round = 0; round < 200; round++) {
    TriangleMesh mesh;
    uint32_t vertices = 4 + next(12), triangles = 1 + next(60);
    for (uint32_t i = 0; i < vertices; i++)
      mesh.positions.push_back({float(next(50)), float(next(50)), float(next(50))});
    std::set<std::set<std::array<float, 3>>> distinct;
    for (uint32_t i = 0; i < triangles; i++) {
      mesh.triangles.push_back({next(vertices), next(vertices), next(vertices)});
      std::set<std::array<float, 3>> corners;
      for (uint32_t v : mesh.triangles.back()) corners.insert(mesh.positions[v]);
      if (corners.size() == 3) distinct.insert(corners);
    }
    if (distinct.empty()) continue;
    SCOPED_TRACE(round);
    Surface s = build_surface(mesh);
    expect_manifold(s);
    EXPECT_EQ(s.faces.size(), distinct.size());
  }
}

// A sheet without one of its triangles ends at two loops; a loop below the least radius is no end.
TEST(SurfaceBorder, TellsLoopsAndDistances) {
  TriangleMesh mesh = make_waves(40);  // 2 wide
  const size_t gone = 1640;            // in the middle
  std::array<double, 3> hole = {0, 0, 0};
  for (uint32_t v : mesh.triangles[gone])
    for (size_t k = 0; k < 3; k++) hole[k] += mesh.positions[v][k] / 3;
  mesh.triangles.erase(mesh.triangles.begin() + ptrdiff_t(gone));
  const Surface s = build_surface(mesh);
  const double width = 2 / s.scale, cell = width / 40, reach = 5 * cell;
  const SurfaceBorder border = border_of(s, reach);
  ASSERT_EQ(border.loops.size(), 2u);
  const int small = border.loops[0].radius < border.loops[1].radius ? 0 : 1;
  EXPECT_LT(border.loops[size_t(small)].radius, cell);
  EXPECT_GT(border.loops[size_t(1 - small)].radius, width / 2);
  const Vec3 middle = s.origin + s.scale * border.loops[size_t(small)].middle;
  EXPECT_LT((middle - Vec3(hole[0], hole[1], hole[2])).norm(), 1e-3);
  size_t far = 0;
  for (size_t f = 0; f < s.faces.size(); f++) {
    EXPECT_EQ(border.loop[f] < 0, border.distance[f] == INFINITY);
    far += border.loop[f] < 0;
    for (int g : s.adjacent[f]) {  // a step leads no farther than it is long
      if (g < 0) {
        EXPECT_EQ(border.distance[f], 0);
      } else if (border.distance[f] < reach - 2 * cell) {
        EXPECT_LT(border.distance[size_t(g)], border.distance[f] + 2 * cell);
      }
    }
  }
  EXPECT_GT(far, s.faces.size() / 4);
  EXPECT_EQ(border_of(s, reach, 2 * cell).loops.size(), 1u);
  EXPECT_TRUE(border_of(build_surface(make_torus(48, 24)), reach).distance.empty());
}

}  // namespace
}  // namespace relief
