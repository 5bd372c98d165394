// What the encoder learns by decoding its own streams.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include "gaps.h"
#include "measure/surface_error.h"
#include "measure/topology.h"
#include "relief/encoder.h"
#include "seams/borders.h"
#include "seams/folds.h"
#include "seams/mask_edits.h"
#include "shapes.h"
#include "surface/half_edges.h"
#include "surface/handle_places.h"
#include "tube.h"

namespace relief {
namespace {

// The border counted from trial to trial is that of the whole mesh, whichever faces between patches are open.
TEST(Borders, AreThoseOfTheMesh) {
  uint64_t most_loops = 0;
  TriangleMesh cut_torus = make_torus(72, 40);
  std::erase_if(cut_torus.triangles, [&](const auto& t) { return cut_torus.positions[t[0]][0] > 0.8f; });
  for (const TriangleMesh& mesh : {make_waves(60), make_hemisphere(24, 72), cut_torus, make_torus(72, 40)}) {
    EncodeOptions options;
    options.error = 2e-3;
    options.aperture = 30;  // several patches
    const std::vector<uint8_t> stream = encode(mesh, options).stream;
    PatchDecoder decoder(stream);
    const DecodedMesh filled = decoder.close({});
    const Borders borders(filled);
    const uint32_t faces = uint32_t(filled.first_triangle.size());
    for (uint32_t every : {1u, 2u, 3u, 7u, faces}) {
      Seams seams;
      for (uint32_t f = 0; f < faces; f += every) seams.holes.push_back(f);
      const DecodedMesh decoded = decoder.close(seams);
      const Borders::Count border = borders.count(decoded);
      const Topology whole = topology(decoded.mesh);
      ASSERT_EQ(whole.nonmanifold_edges + whole.nonmanifold_vertices, 0u);
      EXPECT_EQ(border.edges, whole.open_edges) << every;
      EXPECT_EQ(border.loops, whole.boundary_loops) << every;
      most_loops = std::max(most_loops, border.loops);
    }
  }
  EXPECT_GT(most_loops, 4u);
}

// Pairs of neighbours that turn over, one of them between patches at least, counted over all edges of the
// mesh.
size_t count_folds(const DecodedMesh& d, const Ground& ground) {
  size_t folds = 0;
  for_each_edge(d.mesh.triangles, d.mesh.positions.size(), [&](std::span<const uint32_t> edge) {
    if (edge.size() != 2 || edge[1] / 3 < d.patch_triangles()) return;
    const Vec3 m = unit_normal(d, ground, edge[0] / 3), n = unit_normal(d, ground, edge[1] / 3);
    folds += m.dot(n) < std::cos(150 * M_PI / 180);
  });
  return folds;
}

// Links that are left out make larger faces, some of which can only be closed with folds: all are found, and
// none where the surface itself is folded.
TEST(Folds, AreThoseOfTheMesh) {
  size_t most = 0;
  for (const TriangleMesh& mesh : {make_torus(72, 40), make_plate(20), make_bumpy_sphere(5)}) {
    EncodeOptions options;
    options.error = 2e-3;
    options.aperture = 30;
    const std::vector<uint8_t> stream = encode(mesh, options).stream;
    PatchDecoder decoder(stream);
    const Surface surface = build_surface(mesh);
    const Ground ground = {surface, {}, {}, {1e-6 / surface.scale}};
    const DecodedMesh plain = decoder.close({});
    const FoldFinder finder(plain, ground, folded_vertices(surface));
    for (uint32_t every : {2u, 3u, 5u}) {
      Seams seams;
      for (uint32_t l = 0; l < plain.links.size(); l += every) seams.dropped_links.push_back(l);
      const DecodedMesh decoded = decoder.close(seams);
      const std::vector<Fold> folds = finder.find(decoded);
      EXPECT_EQ(folds.size(), count_folds(decoded, ground));
      most = std::max(most, folds.size());
      for (const Fold& f : folds)
        EXPECT_LT(
            unit_normal(decoded, ground, f.triangle[0]).dot(unit_normal(decoded, ground, f.triangle[1])),
            -0.8);
    }
  }
  EXPECT_GT(most, 0u);
}

// Whichever triangles tubes join, neighbours and such at a border too: each makes a handle, and nothing else.
TEST(Tubes, MakeHandles) {
  std::mt19937 random(7);
  for (const TriangleMesh& shape : {make_torus(24, 12), make_hemisphere(8, 24), make_plate(8)}) {
    TriangleMesh mesh = scaled(shape, 1 << 18);
    for (auto& p : mesh.positions)
      for (float& c : p) c = std::round(c);
    const Topology before = topology(mesh);
    const uint32_t triangles = uint32_t(mesh.triangles.size()), vertices = uint32_t(mesh.positions.size());
    std::vector<uint32_t> order(triangles);
    std::iota(order.begin(), order.end(), 0u);
    std::shuffle(order.begin(), order.end(), random);
    const uint32_t count = triangles / 2;  // all triangles are of one
    mesh.positions.resize(vertices + count * kTubeVertices);
    mesh.triangles.resize(triangles + count * kTubeTriangles);
    MeshWriter writer = {mesh.positions[0].data(),
                         mesh.triangles[0].data(),
                         uint32_t(mesh.positions.size()),
                         uint32_t(mesh.triangles.size()),
                         vertices,
                         triangles};
    for (uint32_t i = 0; i < count; i++) ASSERT_TRUE(add_tube(writer, order[2 * i], order[2 * i + 1]));
    EXPECT_FALSE(add_tube(writer, 0, 1)) << "no room";
    const Topology after = topology(mesh);
    EXPECT_EQ(after.genus, before.genus + count);
    EXPECT_EQ(after.nonmanifold_edges + after.nonmanifold_vertices, 0u);
    EXPECT_EQ(after.boundary_loops, before.boundary_loops);
    EXPECT_EQ(after.components, 1u);
  }
}

// On a flat sheet a tube between the two triangles of a square folds nothing over, and stays near it.
TEST(Tubes, AreSmallArches) {
  TriangleMesh mesh = scaled(make_height_field(8, [](double, double) { return 0; }), 4096);
  const size_t vertices = mesh.positions.size(), triangles = mesh.triangles.size();
  mesh.positions.resize(vertices + kTubeVertices);
  mesh.triangles.resize(triangles + kTubeTriangles);
  MeshWriter writer = {
      mesh.positions[0].data(),        mesh.triangles[0].data(), uint32_t(mesh.positions.size()),
      uint32_t(mesh.triangles.size()), uint32_t(vertices),       uint32_t(triangles)};
  ASSERT_TRUE(add_tube(writer, 54, 55));
  EXPECT_EQ(topology(mesh).flipped, 0u);
  for (size_t v = vertices; v < mesh.positions.size(); v++) {
    EXPECT_GT(mesh.positions[v][2], 0);
    EXPECT_LT(mesh.positions[v][2], 1024 / 2);  // of squares of 1024
  }
}

// Seams that join a triangle twice, or what is no triangle of a patch, are refused; others are not
// remembered.
TEST(Tubes, JoinTrianglesOfPatchesOnce) {
  EncodeOptions options;
  options.error = 1e-3;
  PatchDecoder decoder(encode(make_torus(72, 40), options).stream);
  const DecodedMesh plain = decoder.close({});
  const uint32_t all = uint32_t(plain.patch_triangles());
  auto close = [&](std::vector<std::array<uint32_t, 2>> tubes) {
    Seams seams;
    seams.tubes = std::move(tubes);
    return decoder.close(seams);
  };
  const int64_t genus = topology(plain.mesh).genus;
  const DecodedMesh two = close({{5, 6}, {7, all - 1}});
  EXPECT_EQ(topology(two.mesh).genus, genus + 2);
  EXPECT_EQ(two.mesh.triangles.size(), plain.mesh.triangles.size() + 2 * kTubeTriangles);
  EXPECT_EQ(decoder.close({}).mesh.triangles, plain.mesh.triangles);
  const DecodedMesh spare = close({});
  Seams seams;
  seams.tubes = {{5, 6}};
  EXPECT_EQ(decoder.close(seams, spare).mesh.triangles, close({{5, 6}}).mesh.triangles);
  EXPECT_THROW(close({{5, 6}, {6, 7}}), std::logic_error);
  EXPECT_THROW(close({{5, 7}, {6, 7}}), std::logic_error);
}

// Points anywhere between patches, at most one of a triangle. bad: places where no later triangle has the
// edge
std::vector<SteinerPoint> points_anywhere(const DecodedMesh& plain, std::vector<SteinerPoint>& bad) {
  std::mt19937 random(7);
  const uint32_t first = uint32_t(plain.patch_triangles()), end = uint32_t(plain.mesh.triangles.size());
  std::map<std::array<uint32_t, 2>, uint32_t> sides;  // the triangle of each directed edge
  for (uint32_t t = first; t < end; t++)
    for (uint32_t k = 0; k < 3; k++)
      sides[{plain.mesh.triangles[t][k], plain.mesh.triangles[t][(k + 1) % 3]}] = t;
  std::vector<SteinerPoint> good;
  std::set<uint32_t> taken;
  for (uint32_t t = first; t < end; t++) {
    const SteinerPoint point = {t - first, uint32_t(random() % 3), int32_t(random() % 9) - 4};
    const auto& c = plain.mesh.triangles[t];
    const auto other = sides.find({c[(point.edge + 1) % 3], c[point.edge]});
    if (other == sides.end() || other->second < t || other->second > t + 256)
      bad.push_back(point);
    else if (!taken.count(t) && !taken.count(other->second))
      good.push_back(point), taken.insert(t), taken.insert(other->second);
  }
  return good;
}

// The mesh stays what it was, with a vertex and two triangles more for each point.
TEST(SteinerPoints, SplitEdges) {
  for (const TriangleMesh& mesh : {make_torus(72, 40), make_hemisphere(40, 80)}) {
    EncodeOptions options;
    options.error = 1e-3;
    options.aperture = 30;
    PatchDecoder decoder(encode(mesh, options).stream);
    const DecodedMesh plain = decoder.close({});
    std::vector<SteinerPoint> bad;
    Seams seams;
    seams.steiner_points = points_anywhere(plain, bad);
    const size_t count = plain.nodes.size() / 8;  // and no more
    ASSERT_GT(seams.steiner_points.size(), count);
    seams.steiner_points.resize(count + 1);
    EXPECT_THROW(decoder.close(seams), std::logic_error);
    seams.steiner_points.resize(count);
    const DecodedMesh split = decoder.close(seams);
    EXPECT_EQ(split.mesh.positions.size(), plain.mesh.positions.size() + count);
    EXPECT_EQ(split.mesh.triangles.size(), plain.mesh.triangles.size() + 2 * count);
    const Topology was = topology(plain.mesh), is = topology(split.mesh);
    EXPECT_EQ(is.nonmanifold_edges + is.nonmanifold_vertices, 0u);
    EXPECT_EQ(is.components, was.components);
    EXPECT_EQ(is.boundary_loops, was.boundary_loops);
    EXPECT_EQ(is.genus, was.genus);
    EXPECT_EQ(decoder.close({}).mesh.triangles, plain.mesh.triangles) << "remembers";
    ASSERT_GT(bad.size(), 5u);
    bad.resize(std::min(bad.size(), count));
    seams.steiner_points = bad;
    EXPECT_EQ(decoder.close(seams).mesh.triangles, plain.mesh.triangles);
  }
}

// A point stands over the middle of its edge, by as many eighths of the edge's length as the stream says.
TEST(SteinerPoints, StandOverTheMiddle) {
  EncodeOptions options;
  options.error = 1e-3;
  options.aperture = 30;
  PatchDecoder decoder(encode(make_torus(72, 40), options).stream);
  const DecodedMesh plain = decoder.close({});
  const auto at = [](const TriangleMesh& m, uint32_t v) {
    return Vec3(m.positions[v][0], m.positions[v][1], m.positions[v][2]);
  };
  size_t looked_at = 0;
  for (uint32_t t = uint32_t(plain.patch_triangles()); t + 1 < plain.mesh.triangles.size(); t += 7) {
    const auto &c = plain.mesh.triangles[t], &d = plain.mesh.triangles[t + 1];
    for (uint32_t k = 0; k < 3; k++)
      for (uint32_t l = 0; l < 3; l++) {
        if (c[k] != d[(l + 1) % 3] || c[(k + 1) % 3] != d[l]) continue;
        for (int32_t height : {-9, 3, 20}) {
          Seams seams;
          seams.steiner_points = {{t - uint32_t(plain.patch_triangles()), k, height}};
          const DecodedMesh split = decoder.close(seams);
          const Vec3 a = at(plain.mesh, c[k]), b = at(plain.mesh, c[(k + 1) % 3]);
          const Vec3 across = at(plain.mesh, c[(k + 2) % 3]) - at(plain.mesh, d[(l + 2) % 3]);
          const double length = (b - a).norm();
          const Vec3 point = (a + b) / 2 + height / 8.0 * length * (b - a).cross(across).normalized();
          EXPECT_LT((at(split.mesh, uint32_t(split.mesh.positions.size() - 1)) - point).norm(),
                    0.02 * length);
          looked_at++;
        }
      }
  }
  EXPECT_GT(looked_at, 20u);
}

TEST(SteinerPoints, AreLowerThan16Lengths) {
  EncodeOptions options;
  options.error = 1e-3;
  PatchDecoder decoder(encode(make_torus(72, 40), options).stream);
  std::vector<SteinerPoint> bad;
  Seams seams;
  seams.steiner_points = points_anywhere(decoder.close({}), bad);
  seams.steiner_points.resize(1);
  for (int32_t height : {127, -128, 128, -129}) {
    seams.steiner_points[0].height = height;
    if (height == 127 || height == -128) {
      EXPECT_NO_THROW(decoder.close(seams));
    } else {
      EXPECT_THROW(decoder.close(seams), std::logic_error);
    }
  }
}

// What the encoder takes makes the error less than it is without, at whatever target it takes any.
TEST(SteinerPoints, LessenTheError) {
  const TriangleMesh mesh = make_bumpy_sphere(6);
  const ErrorMeter meter(mesh, 200000);
  int with_points = 0;
  for (double error : {1.4e-3, 1e-3, 7e-4, 5e-4}) {
    EncodeOptions options;
    options.error = error;
    options.aperture = 30;
    const std::vector<uint8_t> stream = encode(mesh, options).stream;
    PatchDecoder decoder(stream);
    const DecodedMesh with = decode_with_seams(stream);
    const uint8_t* const seams = seams_of(decoder.parsed(), stream.data());
    const uint8_t* const end = stream.data() + decoder.parsed().colours_begin;
    const uint8_t* sixth = seams;  // the sixth list
    for (int lists = 0; lists < 5 && sixth != end; sixth++) lists += *sixth == 0;
    if (end - sixth <= 2) continue;
    with_points++;
    const DecodedMesh without = decoder.close(seams, sixth);
    EXPECT_LT(without.mesh.positions.size(), with.mesh.positions.size()) << error;
    EXPECT_LT(meter.measure(with.mesh).rms, 0.999 * meter.measure(without.mesh).rms) << error;
    EXPECT_LE(topology(with.mesh).flipped, topology(without.mesh).flipped) << error;
  }
  EXPECT_GT(with_points, 0);
}

// Each handle is found once, where it is: pinholes of a plate, the smallest first.
TEST(HandlePlaces, AreWhereTheHandlesAre) {
  const std::vector<std::array<double, 2>> places = {{-0.5, -0.4}, {0.3, 0.1}, {0.6, -0.7}};
  for (const TriangleMesh& sheet : {make_torus(72, 40), make_sphere(3), make_waves(12)})
    EXPECT_EQ(handle_places(build_surface(sheet)).size(), size_t(topology(sheet).genus));
  const Surface surface = build_surface(drilled(make_plate(64, 0.05), places));
  const std::vector<HandlePlace> found = handle_places(surface);
  ASSERT_EQ(found.size(), places.size());
  std::set<size_t> seen;
  for (const HandlePlace& handle : found) {
    const Vec3 p = surface.origin + surface.scale * handle.middle;
    for (size_t i = 0; i < places.size(); i++)
      if (std::hypot(p[0] - places[i][0], p[1] - places[i][1]) < 0.15) seen.insert(i);
  }
  EXPECT_EQ(seen.size(), places.size());
}

// Patches of two squares of pixels side by side.
struct TwoPatches {
  std::vector<uint8_t> mask = std::vector<uint8_t>(64, 1);
  std::vector<float> z = std::vector<float>(64, 3.0f);
  std::vector<int> face = std::vector<int>(64, 0);
  WaveletImage image = forward_wavelet(8, 8, mask.data(), z.data());
  std::vector<CodedPatch> patches;
  TwoPatches() {
    CodedPatch patch = {};
    patch.header.width = patch.header.height = 8;
    patch.mask = mask.data(), patch.image = &image, patch.z = z.data(), patch.face = face.data();
    patches = {patch, patch};
  }
};

size_t pixels_in(const CodedPatch& p) { return size_t(std::count(p.mask, p.mask + 64, 1)); }

TEST(MaskEdits, TakeOutAndPutBack) {
  const TwoPatches two;
  std::list<CleanedPatch> storage;
  MaskEdits edits(two.patches, storage);
  EXPECT_FALSE(edits.apply());  // nothing to do
  edits.take_out({1, 7});
  edits.take_out({1, 63});
  ASSERT_TRUE(edits.apply());
  EXPECT_EQ(edits.patches()[0].mask, two.patches[0].mask);  // untouched
  EXPECT_EQ(pixels_in(edits.patches()[1]), 62u);
  EXPECT_EQ(edits.patches()[1].mask[7], 0);
  EXPECT_EQ(edits.patches()[1].image->mask.size(), two.image.mask.size());
  edits.put_back({1, 7});
  EXPECT_TRUE(edits.is_held({1, 7}));
  EXPECT_FALSE(edits.is_held({1, 63}));
  ASSERT_TRUE(edits.apply());
  EXPECT_EQ(pixels_in(edits.patches()[1]), 63u);
  edits.put_back({1, 63});
  ASSERT_TRUE(edits.apply());
  EXPECT_EQ(edits.patches()[1].image, two.patches[1].image);  // as it was
  EXPECT_FALSE(edits.apply());
}

TEST(MaskEdits, PatchesWithoutPixelsAreGone) {
  const TwoPatches two;
  std::list<CleanedPatch> storage;
  MaskEdits edits(two.patches, storage);
  for (uint32_t i = 0; i < 64; i++)
    if (i != 20) edits.take_out({0, i});  // one pixel alone is in no triangle
  ASSERT_TRUE(edits.apply());
  EXPECT_EQ(edits.patches().size(), 1u);
  EXPECT_EQ(edits.number(), (std::vector<int>{-1, 0}));
  const Pixel whole = edits.whole_pixel({0, 5});
  EXPECT_EQ(whole.patch, 1u);
  EXPECT_EQ(whole.index, 5u);
  for (uint32_t i = 0; i < 64; i++) edits.take_out({1, i});
  EXPECT_FALSE(edits.apply());  // nothing would be left
  EXPECT_EQ(edits.patches().size(), 1u);
}

}  // namespace
}  // namespace relief
