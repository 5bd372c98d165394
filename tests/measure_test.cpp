// The surface error against analytic distances, and the counts of topology.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Core>

#include "measure/sampling.h"
#include "measure/surface_error.h"
#include "measure/topology.h"
#include "shapes.h"

namespace relief {
namespace {

constexpr size_t kSamples = 20000;

TEST(SurfaceError, ConcentricSpheres) {
  for (double unit : {1e-3, 1.0, 1e6}) {  // of the coordinates
    ErrorMeter meter(make_sphere(5, unit), kSamples);
    SurfaceError e = meter.measure(make_sphere(5, 1.01 * unit));
    EXPECT_NEAR(e.rms_ab, 0.01 * unit, 2e-5 * unit);
    EXPECT_NEAR(e.rms_ba, 0.01 * unit, 2e-5 * unit);
    EXPECT_NEAR(e.max, 0.01 * unit, 5e-5 * unit);
    EXPECT_NEAR(e.diagonal, 2 * std::sqrt(3.0) * unit, 0.02 * unit);
    EXPECT_NEAR(e.psnr, 20 * std::log10(e.diagonal / e.rms), 1e-9);
    EXPECT_LT(e.normal_p99, 3);
  }
}

TEST(SurfaceError, ParallelPlanesOfDifferentSize) {
  TriangleMesh small = make_height_field(20, [](double, double) { return 0; });
  TriangleMesh large = mapped(small, [](shapes::Point p) { return shapes::Point{2 * p[0], 2 * p[1], 0.25}; });
  SurfaceError e = ErrorMeter(small, 200000).measure(large);
  EXPECT_NEAR(e.rms_ab, 0.25, 1e-6);
  EXPECT_NEAR(e.max_ab, 0.25, 1e-6);
  // From the large square [-2, 2]^2: the mean of dx^2 + dy^2 with dx = max(|x| - 1, 0) is 2 * 1/2 * 1/3, and
  // 0.25^2.
  EXPECT_NEAR(e.rms_ba, std::sqrt(1.0 / 3 + 0.0625), 1e-3);
  EXPECT_NEAR(e.max_ba, std::sqrt(2.0625), 0.02);
  EXPECT_EQ(e.rms, e.rms_ba);
  EXPECT_EQ(e.max, e.max_ba);
  EXPECT_NEAR(e.normal_mean, 0, 1e-6);
}

TEST(SurfaceError, EqualMeshesAreAtNoDistance) {
  TriangleMesh mesh = make_bumpy_sphere(5);
  SurfaceError e = ErrorMeter(mesh, kSamples).measure(mesh);
  EXPECT_LT(e.rms, 1e-15 * e.diagonal);
  EXPECT_LT(e.max, 1e-15 * e.diagonal);
  EXPECT_GT(e.psnr, 250);
}

// 1e-6 of the diagonal, 1/100 of the finest target: float coordinates far from the origin still tell it.
TEST(SurfaceError, SmallDistancesFarFromTheOrigin) {
  TriangleMesh mesh = make_height_field(30, [](double, double) { return 0; });
  TriangleMesh other = moved(mesh, 0, 0, 0x1p-18);
  SurfaceError e = ErrorMeter(moved(mesh, 8, 4, 0), kSamples).measure(moved(other, 8, 4, 0));
  EXPECT_NEAR(e.rms, 0x1p-18, 0x1p-30);
}

TEST(SurfaceError, NormalDeviationOfATurnedPlane) {
  TriangleMesh mesh = make_height_field(10, [](double, double) { return 0; });
  double slope = std::tan(10 * shapes::kPi / 180);
  SurfaceError e =
      ErrorMeter(mesh, kSamples).measure(make_height_field(10, [=](double x, double) { return slope * x; }));
  EXPECT_NEAR(e.normal_mean, 10, 1e-4);
  EXPECT_NEAR(e.normal_p99, 10, 1e-4);
  EXPECT_NEAR(ErrorMeter(mesh, kSamples).measure(flipped(mesh)).normal_mean, 180, 1e-4);
}

// One spike on one triangle of 20,480 must show in the maximum and from the side that has it.
TEST(SurfaceError, SeesASpikeFromTheSideThatHasIt) {
  TriangleMesh sphere = make_sphere(5), spiked = sphere;
  for (float& c : spiked.positions[777]) c *= 1.5f;
  SurfaceError e = ErrorMeter(sphere, 100000).measure(spiked);
  EXPECT_GT(e.max_ba, 0.4);
  EXPECT_LT(e.max_ba, 0.5);
  EXPECT_GT(e.rms_ba, 2 * e.rms_ab);
}

// A few far vertices carry nearly all of the error, as on real models: uniform samples would hit the 60
// triangles about them some 60 times and be 10% off.
TEST(SurfaceError, FewSamplesSayWhatManySay) {
  const TriangleMesh sphere = make_sphere(5);
  TriangleMesh spiked = sphere;
  for (size_t v = 7; v < spiked.positions.size(); v += 1000)
    for (float& c : spiked.positions[v]) c *= 1.1f;
  const SurfaceError few = ErrorMeter(sphere, 20000).measure(spiked),
                     many = ErrorMeter(sphere, 2000000).measure(spiked);
  EXPECT_GT(few.rms_deviation, 0);
  EXPECT_LT(few.rms_deviation, 0.01 * few.rms);
  EXPECT_LT(many.rms_deviation, 0.2 * few.rms_deviation);
  EXPECT_NEAR(few.rms, many.rms, 4 * few.rms_deviation);
}

TEST(SurfaceError, SameBitsOnAnyNumberOfThreads) {
  TriangleMesh a = make_bumpy_sphere(5), b = make_sphere(4);
  auto measure = [&](size_t threads) {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return ErrorMeter(a, kSamples).measure(b);
  };
  SurfaceError one = measure(1), four = measure(4);
  EXPECT_EQ(one.rms_ab, four.rms_ab);
  EXPECT_EQ(one.rms_ba, four.rms_ba);
  EXPECT_EQ(one.max, four.max);
  EXPECT_EQ(one.normal_mean, four.normal_mean);
  EXPECT_EQ(one.normal_p99, four.normal_p99);
}

// The plain definition: every sample against every triangle.
double nearest(const Eigen::Vector3d& p, const TriangleMesh& mesh) {
  auto at = [&](uint32_t v) {
    return Eigen::Vector3d(mesh.positions[v][0], mesh.positions[v][1], mesh.positions[v][2]);
  };
  double best = 1e300;
  for (const auto& t : mesh.triangles) {
    Eigen::Vector3d a = at(t[0]), u = at(t[1]) - a, v = at(t[2]) - a, d = p - a;
    double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), det = uu * vv - uv * uv;
    double s = (vv * u.dot(d) - uv * v.dot(d)) / det, r = (uu * v.dot(d) - uv * u.dot(d)) / det;
    if (s >= 0 && r >= 0 && s + r <= 1) best = std::min(best, (d - s * u - r * v).norm());
    for (int k = 0; k < 3; k++) {
      Eigen::Vector3d x = at(t[k]), e = at(t[(k + 1) % 3]) - x;
      best = std::min(best, (p - x - std::clamp((p - x).dot(e) / e.dot(e), 0.0, 1.0) * e).norm());
    }
  }
  return best;
}

TEST(SurfaceError, PositionsAgreeWithSearchingAllTriangles) {
  TriangleMesh original = make_torus(24, 12), other = make_bumpy_sphere(3, 0.2);
  std::vector<float> distances = ErrorMeter(original, 100).distance_of_positions(other);
  ASSERT_EQ(distances.size(), other.positions.size());
  for (size_t i = 0; i < distances.size(); i++) {
    const auto& p = other.positions[i];
    EXPECT_NEAR(distances[i], nearest({p[0], p[1], p[2]}, original), 1e-6);
  }
}

TEST(SurfaceError, TrianglesWithoutAreaAreHarmless) {
  TriangleMesh plane = make_height_field(10, [](double, double) { return 0; }),
               other = moved(plane, 0, 0, 0.5);
  other.triangles.insert(other.triangles.begin(), {{0, 0, 0}, {0, 1, 0}, {0, 1, 2}});
  SurfaceError e = ErrorMeter(plane, kSamples).measure(other);
  EXPECT_NEAR(e.rms, 0.5, 1e-9);
  TriangleMesh flat = plane;
  flat.triangles = {{0, 1, 2}};
  EXPECT_THROW(ErrorMeter(plane, 10).measure(flat), InputError);
  EXPECT_THROW(ErrorMeter(flat, 10), InputError);
  EXPECT_THROW(ErrorMeter(TriangleMesh(), 10), InputError);
}

TEST(Sampling, FollowsTheArea) {
  // A square of area 3 and one of area 1, and a triangle without area between them.
  std::vector<Eigen::Vector3d> p = {{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {0, 1, 0},
                                    {5, 0, 0}, {6, 0, 0}, {6, 1, 0}, {5, 1, 0}};
  std::vector<std::array<uint32_t, 3>> t = {{0, 1, 2}, {0, 2, 3}, {0, 1, 1}, {4, 5, 6}, {4, 6, 7}};
  auto samples = sample_surface(p, t, 8000);
  std::array<int, 5> hits{};
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& s : samples) {
    hits[s.triangle]++;
    if (s.triangle < 2) sum += s.point;
  }
  EXPECT_NEAR(hits[0], 3000, 1);
  EXPECT_NEAR(hits[1], 3000, 1);
  EXPECT_EQ(hits[2], 0);
  EXPECT_NEAR(hits[3], 1000, 1);
  EXPECT_NEAR(sum[0] / (hits[0] + hits[1]), 1.5, 0.01) << "the centroid of the large square";
  EXPECT_NEAR(sum[1] / (hits[0] + hits[1]), 0.5, 0.01);
}

TEST(Sampling, WeightedSamplesStandForLessArea) {
  std::vector<Eigen::Vector3d> p = {{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {2, 1, 0}};
  std::vector<std::array<uint32_t, 3>> t = {{0, 1, 2}, {1, 3, 2}};
  std::array<int, 2> hits{};
  std::array<double, 2> area{};
  for (const auto& s : sample_surface(p, t, 4000, {1, 3})) hits[s.triangle]++, area[s.triangle] += s.area;
  EXPECT_NEAR(hits[0], 1000, 1);
  EXPECT_NEAR(hits[1], 3000, 1);
  EXPECT_NEAR(area[0], 1, 2e-3);
  EXPECT_NEAR(area[1], 1, 2e-3);
}

struct Expected {
  uint64_t components, open, loops;
  int64_t euler, genus;
};

void expect_topology(const TriangleMesh& mesh, Expected expected) {
  Topology t = topology(mesh);
  EXPECT_EQ(t.vertices, mesh.positions.size());
  EXPECT_EQ(t.triangles, mesh.triangles.size());
  EXPECT_EQ(t.components, expected.components);
  EXPECT_EQ(t.open_edges, expected.open);
  EXPECT_EQ(t.boundary_loops, expected.loops);
  EXPECT_EQ(t.euler, expected.euler);
  EXPECT_EQ(t.genus, expected.genus);
  EXPECT_EQ(t.nonmanifold_edges, 0u);
  EXPECT_EQ(t.nonmanifold_vertices, 0u);
  EXPECT_EQ(t.flipped, 0u);
}

TEST(Topology, OfShapes) {
  expect_topology(make_sphere(3), {1, 0, 0, 2, 0});
  expect_topology(make_torus(20, 12), {1, 0, 0, 0, 1});
  expect_topology(make_nested_spheres(2), {2, 0, 0, 4, 0});
  expect_topology(make_cube(5), {1, 0, 0, 2, 0});
  expect_topology(make_plate(6), {1, 0, 0, 2, 0});
  expect_topology(make_hemisphere(5, 16), {1, 16, 1, 1, 0});
  expect_topology(make_waves(8), {1, 32, 1, 1, 0});
  expect_topology(joined(make_torus(20, 12), make_hemisphere(5, 16)), {2, 16, 1, 1, 1});
}

TEST(Topology, OfHoles) {
  TriangleMesh mesh = make_torus(20, 12);
  mesh.triangles.erase(mesh.triangles.begin() + 100);
  mesh.triangles.erase(mesh.triangles.begin() + 10);
  expect_topology(mesh, {1, 6, 2, -2, 1});
}

TEST(Topology, OfWhatIsNotManifold) {
  TriangleMesh fins;
  fins.positions = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}, {9, 9, 9}};
  fins.triangles = {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}};
  Topology t = topology(fins);
  EXPECT_EQ(t.vertices, 5u) << "unused ones are not counted";
  EXPECT_EQ(t.components, 1u);
  EXPECT_EQ(t.nonmanifold_edges, 1u);
  EXPECT_EQ(t.nonmanifold_vertices, 2u);
  EXPECT_EQ(t.open_edges, 6u);
  EXPECT_EQ(t.genus, -1);

  TriangleMesh bow = joined(make_sphere(1), moved(make_sphere(1), 5, 0, 0));
  uint32_t half = uint32_t(bow.positions.size() / 2);
  for (auto& triangle : bow.triangles)
    for (uint32_t& v : triangle)
      if (v == half) v = 0;
  t = topology(bow);
  EXPECT_EQ(t.components, 2u) << "a shared vertex does not connect";
  EXPECT_EQ(t.nonmanifold_vertices, 1u);
  EXPECT_EQ(t.nonmanifold_edges, 0u);
  EXPECT_EQ(t.genus, -1);

  TriangleMesh turned = make_sphere(2);
  std::swap(turned.triangles[9][0], turned.triangles[9][1]);
  t = topology(turned);
  EXPECT_EQ(t.nonmanifold_edges, 3u) << "edges that both triangles run the same way";
  EXPECT_EQ(t.open_edges, 0u);
  EXPECT_EQ(t.boundary_loops, 0u);
}

TEST(Topology, CountsFlippedPairs) {
  TriangleMesh mesh;  // a strip folded back onto itself, two degrees short of shut
  mesh.positions = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 0, 0.035f}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}};
  EXPECT_EQ(topology(mesh).flipped, 1u);
  mesh.positions[3] = {0, 0, 1};
  EXPECT_EQ(topology(mesh).flipped, 0u);
}

TEST(Topology, ByPositionJoinsSplitVertices) {
  TriangleMesh mesh = make_cube(3), loose;
  for (const auto& t : mesh.triangles) {
    loose.triangles.push_back({});
    for (int k = 0; k < 3; k++) {
      loose.triangles.back()[k] = uint32_t(loose.positions.size());
      loose.positions.push_back(mesh.positions[t[k]]);
    }
  }
  EXPECT_EQ(topology(loose).components, mesh.triangles.size());
  Topology t = topology(loose, true);
  EXPECT_EQ(t.vertices, mesh.positions.size());
  EXPECT_EQ(t.components, 1u);
  EXPECT_EQ(t.euler, 2);
  EXPECT_EQ(t.genus, 0);
}

}  // namespace
}  // namespace relief
