// Closed stays closed (plan, section 7): the topology of what comes back is that of what went in.
#include "measure/topology.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "closed_shapes.h"
#include "measure/surface_error.h"
#include "relief/encoder.h"

namespace relief {
namespace {

class ClosedShapes : public testing::TestWithParam<int> {};

// Below this error the most time goes: one partition does there.
constexpr double kFine = 2e-4;

// The shapes are what they claim to be: a test of topology() as well.
TEST_P(ClosedShapes, ComeBackTheSame) {
  const ClosedShape shape = closed_shapes()[size_t(GetParam())];
  const TriangleMesh mesh = shape.make();
  const Topology before = topology(mesh);
  ASSERT_EQ(before.components, size_t(shape.components)) << shape.name;
  ASSERT_EQ(before.genus, shape.genus) << shape.name;
  ASSERT_EQ(before.open_edges, 0u) << shape.name;
  ASSERT_EQ(before.nonmanifold_edges + before.nonmanifold_vertices, 0u) << shape.name;
  for (double error : {4e-3, 1e-3, 4e-4, 1e-4}) {
    SCOPED_TRACE(shape.name + " at " + std::to_string(error));
    EncodeOptions options;
    options.error = error;
    if (error < kFine) options.effort = kOnePartition;
    const EncodeResult result = encode(mesh, options);
    const TriangleMesh decoded = decode(result.stream.data(), result.stream.size());
    for (bool by_position : {false, true}) {
      const Topology after = topology(decoded, by_position);
      EXPECT_EQ(after.components, before.components) << by_position;
      EXPECT_EQ(after.genus, before.genus) << by_position;
      EXPECT_EQ(after.boundary_loops, 0u) << by_position;
      EXPECT_EQ(after.open_edges, 0u) << by_position;
      EXPECT_EQ(after.nonmanifold_edges, 0u) << by_position;
      EXPECT_EQ(after.nonmanifold_vertices, 0u) << by_position;
      if (!by_position)
        std::printf(
            "%-16s %6zu triangles, E <= %g: %6zu bytes, %6zu triangles, %u patches, flipped %zu -> %zu\n",
            shape.name.c_str(), mesh.triangles.size(), error, result.stream.size(),
            decoded.triangles.size(), result.patches, size_t(before.flipped), size_t(after.flipped));
    }
  }
}

// An open surface keeps its boundary loops: a sheet with a slit narrower than the grid, and one with windows.
TEST(OpenShapes, KeepTheirLoops) {
  const TriangleMesh sheet = make_waves(60);
  auto without = [](TriangleMesh mesh, const std::function<bool(double, double)>& gone) {
    std::erase_if(mesh.triangles, [&](const auto& t) {
      double x = 0, y = 0;
      for (uint32_t v : t) x += mesh.positions[v][0] / 3, y += mesh.positions[v][1] / 3;
      return gone(x, y);
    });
    return mesh;
  };
  const TriangleMesh meshes[] = {
      without(sheet, [](double x, double y) { return std::fabs(x) < 0.0333 && std::fabs(y) < 0.5; }),
      without(sheet,
              [](double x, double y) {
                return std::fabs(std::fabs(x) - 0.5) < 0.2 && std::fabs(std::fabs(y) - 0.5) < 0.2;
              }),
      make_hemisphere(24, 72)};
  for (size_t i = 0; i < std::size(meshes); i++)
    for (double error : {2e-3, 5e-4, 1e-4}) {
      SCOPED_TRACE("mesh " + std::to_string(i) + " at " + std::to_string(error));
      EncodeOptions options;
      options.error = error;
      if (error < kFine) options.effort = kOnePartition;
      const EncodeResult result = encode(meshes[i], options);
      const Topology before = topology(meshes[i]),
                     after = topology(decode(result.stream.data(), result.stream.size()));
      EXPECT_EQ(after.boundary_loops, before.boundary_loops);
      EXPECT_EQ(after.components, before.components);
      EXPECT_EQ(after.genus, before.genus);
      EXPECT_EQ(after.nonmanifold_edges + after.nonmanifold_vertices, 0u);
    }
}

std::vector<std::array<float, 3>> border_vertices(const TriangleMesh& mesh) {
  std::set<std::array<uint32_t, 2>> edges;
  for (const auto& t : mesh.triangles)
    for (size_t k = 0; k < 3; k++) edges.insert({t[k], t[(k + 1) % 3]});
  std::vector<std::array<float, 3>> found;
  for (const auto& [a, b] : edges)
    if (!edges.count({b, a})) found.push_back(mesh.positions[a]);
  return found;
}

// The largest distance from one of `from` to the nearest of `to`.
double farthest(const std::vector<std::array<float, 3>>& from, const std::vector<std::array<float, 3>>& to) {
  double most = 0;
  for (const auto& p : from) {
    double least = INFINITY;
    for (const auto& q : to)
      least = std::min(least, std::hypot(double(p[0] - q[0]), double(p[1] - q[1]), double(p[2] - q[2])));
    most = std::max(most, least);
  }
  return most;
}

// Loops stay where they are, however small, and the surface opens nowhere else: neither beside a hole of one
// triangle nor around a limb that closes to a ring, across which the decoder's links would make a handle.
TEST(OpenShapes, OpenWhereTheyDid) {
  TriangleMesh sheet = make_waves(60);
  for (size_t t : {1500, 3300, 5000}) sheet.triangles.erase(sheet.triangles.begin() + ptrdiff_t(t));
  TriangleMesh ring = make_torus(144, 60), window = ring;
  ring.triangles.erase(ring.triangles.begin() + 4000);
  std::erase_if(window.triangles, [&](const auto& t) { return window.positions[t[0]][0] > 1.3f; });
  for (const TriangleMesh& mesh : {sheet, ring, window}) {
    const Topology before = topology(mesh);
    const auto border = border_vertices(mesh);
    for (double error : {2e-3, 5e-4, 1e-4}) {
      SCOPED_TRACE(std::to_string(mesh.triangles.size()) + " triangles at " + std::to_string(error));
      EncodeOptions options;
      options.error = error;
      if (error < kFine) options.effort = kOnePartition;
      options.aperture = 30;  // many patches
      const EncodeResult result = encode(mesh, options);
      const TriangleMesh decoded = decode(result.stream.data(), result.stream.size());
      const Topology after = topology(decoded);
      EXPECT_EQ(after.boundary_loops, before.boundary_loops);
      EXPECT_EQ(after.components, before.components);
      EXPECT_EQ(after.genus, before.genus);
      const auto border_after = border_vertices(decoded);
      constexpr double kNear = 0.25;  // of surfaces 2 and 2.6 wide
      EXPECT_LT(farthest(border_after, border), kNear);
      EXPECT_LT(farthest(border, border_after), kNear);
    }
  }
}

// Handles that the grid is too coarse for come back where they were, unless they are not wanted.
TEST(SmallHandles, ComeBackUnlessDropped) {
  const std::vector<std::array<double, 2>> places = {{-0.5, -0.4}, {0.3, 0.1}, {0.6, -0.7}, {-0.1, 0.75}};
  const TriangleMesh plate = drilled(make_plate(48, 0.1), places);
  ASSERT_EQ(topology(plate).genus, 4);
  for (double error : {4e-3, 1e-3}) {
    EncodeOptions options;
    options.error = error;
    const EncodeResult with = encode(plate, options);
    options.keep_handles = false;
    const EncodeResult without = encode(plate, options);
    const TriangleMesh decoded = decode(with.stream.data(), with.stream.size());
    const Topology t = topology(decoded);
    EXPECT_EQ(t.genus, 4);
    EXPECT_EQ(t.components, 1u);
    EXPECT_EQ(t.open_edges + t.nonmanifold_edges + t.nonmanifold_vertices, 0u);
    EXPECT_TRUE(with.warnings.empty());
    const TriangleMesh closed = decode(without.stream.data(), without.stream.size());
    EXPECT_LT(topology(closed).genus, 4) << "the grid is fine enough: this tests nothing";
    EXPECT_EQ(without.warnings.size(), 1u);
    EXPECT_LE(with.stream.size(), without.stream.size() + 4 * 6 + 4);
    EXPECT_LT(with.error, error);
    // the tubes' vertices are the last
    const size_t tubes = size_t(4 - topology(closed).genus), vertices = decoded.positions.size();
    for (size_t v = vertices - 6 * tubes; v < vertices; v++) {
      double least = INFINITY;
      for (const auto& at : places)
        least = std::min(least, std::hypot(decoded.positions[v][0] - at[0], decoded.positions[v][1] - at[1]));
      EXPECT_LT(least, 0.3);
    }
  }
}

// Triangles between patches do not turn over on a smooth surface.
TEST(Folds, NoneOnASphere) {
  for (double error : {2e-3, 3e-4}) {
    EncodeOptions options;
    options.error = error;
    const EncodeResult result = encode(make_bumpy_sphere(6), options);
    EXPECT_EQ(topology(decode(result.stream.data(), result.stream.size())).flipped, 0u) << error;
  }
}

TEST(SmallComponents, SurviveUnlessAskedNotTo) {
  TriangleMesh mesh = make_bumpy_sphere(5);
  // in corners of the large one's box: the error's unit, its diagonal, is the same with and without them
  for (int i = 0; i < 3; i++)
    mesh = joined(mesh, moved(make_sphere(0, 0.01), 0.8, 0.8, i == 0 ? -0.8 : 0.4 * i));
  EncodeOptions options;
  options.error = 2e-3;
  const EncodeResult all = encode(mesh, options);
  EXPECT_EQ(topology(decode(all.stream.data(), all.stream.size())).components, 4u);
  options.min_component = 21;
  const EncodeResult large = encode(mesh, options);
  EXPECT_EQ(topology(decode(large.stream.data(), large.stream.size())).components, 1u);
  EXPECT_LT(large.stream.size(), all.stream.size());
  ASSERT_EQ(large.warnings.size(), 1u);
  EXPECT_EQ(large.warnings[0], "dropped 3 small components, 60 triangles, as asked");
  for (size_t t = 0; t < mesh.triangles.size(); t++) EXPECT_EQ(large.labels[t] < 0, t >= 20480) << t;
}

// The seams' smoothing (5.3) moves border vertices only, and a little.
TEST(Smoothing, MovesBordersALittle) {
  const TriangleMesh mesh = make_torus(96, 40);
  EncodeOptions options;
  options.error = 1e-3;
  const EncodeResult result = encode(mesh, options);
  const TriangleMesh plain = decode(result.stream.data(), result.stream.size());
  DecodeOptions smooth;
  smooth.smooth = true;
  const TriangleMesh smoothed = decode(result.stream.data(), result.stream.size(), smooth);
  EXPECT_EQ(plain.triangles, smoothed.triangles);
  size_t moved = 0;
  for (size_t v = 0; v < plain.positions.size(); v++) moved += plain.positions[v] != smoothed.positions[v];
  EXPECT_GT(moved, plain.positions.size() / 100);
  EXPECT_LT(moved, plain.positions.size() / 2);
  const ErrorMeter meter(mesh, 100000);
  const double before = meter.measure(plain).rms, after = meter.measure(smoothed).rms;
  EXPECT_LT(after, 1.5 * before);
}

INSTANTIATE_TEST_SUITE_P(, ClosedShapes, testing::Range(0, int(closed_shapes().size())),
                         [](const auto& shape) {
                           std::string name = closed_shapes()[size_t(shape.param)].name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

}  // namespace
}  // namespace relief
