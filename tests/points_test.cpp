// Point clouds: neighbourhoods, normals, the MLS surface, its triangles, and the way to a stream and back, on
// clouds made here with noise, outliers, uneven density, close sheets and rims. E is in 1e-4 of the diagonal
// of the box.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "measure/surface_error.h"
#include "measure/topology.h"
#include "points/point_normals.h"
#include "points/point_surface.h"
#include "relief/encoder.h"
#include "shapes.h"

namespace relief {
namespace {

constexpr double kPi = 3.14159265358979323846, kE = 1e-4;
const double kSphereDiagonal = 2 * std::sqrt(3.0);

// Random numbers that are the same with every standard library.
class Random {
 public:
  double uniform() { return double(engine_() >> 11) / 9007199254740992.0; }  // [0, 1)
  double normal() { return std::sqrt(-2 * std::log(1 - uniform())) * std::cos(2 * kPi * uniform()); }
  Vec3 direction() {
    const Vec3 v(normal(), normal(), normal());
    return v.normalized();
  }

 private:
  std::mt19937_64 engine_{1};
};

void add(TriangleMesh& cloud, const Vec3& p) {
  cloud.positions.push_back({float(p.x()), float(p.y()), float(p.z())});
}

// `count` points by chance, of those that `keep` keeps with its probability; each moved by `noise` (standard
// deviation) in all directions.
template <class Keep>
TriangleMesh cloud_of_sphere(size_t count, double noise, Keep keep, double radius = 1) {
  TriangleMesh cloud;
  Random random;
  while (cloud.positions.size() < count) {
    const Vec3 v = random.direction();
    if (random.uniform() >= keep(v)) continue;
    add(cloud, radius * v + noise * Vec3(random.normal(), random.normal(), random.normal()));
  }
  return cloud;
}

TriangleMesh cloud_of_sphere(size_t count, double noise) {
  return cloud_of_sphere(count, noise, [](const Vec3&) { return 1.0; });
}

TriangleMesh cloud_of_torus(size_t count, double noise) {
  constexpr double kR = 1, kr = 0.4;
  TriangleMesh cloud;
  Random random;
  while (cloud.positions.size() < count) {
    const double a = 2 * kPi * random.uniform(), b = 2 * kPi * random.uniform();
    if (random.uniform() >= (kR + kr * std::cos(b)) / (kR + kr)) continue;
    const Vec3 p((kR + kr * std::cos(b)) * std::cos(a), (kR + kr * std::cos(b)) * std::sin(a),
                 kr * std::sin(b));
    add(cloud, p + noise * Vec3(random.normal(), random.normal(), random.normal()));
  }
  return cloud;
}

std::vector<Vec3> points_of(const TriangleMesh& cloud) {
  std::vector<Vec3> points;
  for (const auto& p : cloud.positions) points.emplace_back(p[0], p[1], p[2]);
  return points;
}

TEST(KdTree, FindsWhatSearchingAllFinds) {
  const std::vector<Vec3> points = points_of(cloud_of_sphere(500, 0.1));
  const KdTree tree(points);
  std::vector<Neighbour> found;
  for (size_t i = 0; i < points.size(); i += 25) {
    std::vector<std::pair<double, uint32_t>> all;
    for (size_t j = 0; j < points.size(); j++)
      all.push_back({(points[j] - points[i]).squaredNorm(), uint32_t(j)});
    std::sort(all.begin(), all.end());
    tree.nearest(points[i], 7, found);
    ASSERT_EQ(found.size(), 7u);
    for (size_t k = 0; k < 7; k++) EXPECT_EQ(found[k].index, all[k].second);
    tree.within(points[i], 0.3, found);
    EXPECT_EQ(found.size(),
              size_t(std::count_if(all.begin(), all.end(), [](auto& a) { return a.first < 0.09; })));
  }
  const std::vector<Vec3> same(100, Vec3(1, 2, 3));  // no plane cuts these
  KdTree(same).nearest(Vec3::Zero(), 1000, found);
  EXPECT_EQ(found.size(), 100u);
}

TEST(PointNormals, PointOutwardsEverywhere) {
  for (double noise : {0.0, 0.001, 0.003}) {
    const std::vector<Vec3> points = points_of(cloud_of_torus(5000, noise));
    const KdTree tree(points);
    std::vector<double> radius = spacings(tree);
    for (double& r : radius) r *= 2.6;
    std::vector<Vec3> normals = plane_normals(tree, radius);
    EXPECT_EQ(orient_normals(tree, normals), 1u);
    double least = 1;
    for (size_t i = 0; i < points.size(); i++) {
      const Vec3 ring = Vec3(points[i].x(), points[i].y(), 0).normalized();
      least = std::min(least, normals[i].dot((points[i] - ring).normalized()));
    }
    EXPECT_GT(least, 0.75) << "noise " << noise;
  }
}

TEST(Spacing, IsTheRootOfTheAreaOfAPoint) {
  const TriangleMesh cloud = cloud_of_sphere(20000, 0);
  const std::vector<Vec3> points = points_of(cloud);
  std::vector<double> s = spacings(KdTree(points));
  std::sort(s.begin(), s.end());
  EXPECT_NEAR(s[s.size() / 2], std::sqrt(4 * kPi / 20000), 0.04 * std::sqrt(4 * kPi / 20000));
}

// [ABCO*03]: points of the surface project onto themselves; the order of approximation is that of the
// polynomials.
TEST(MlsSurface, ProjectsOntoTheSphere) {
  double last = 1;
  for (size_t count : {2000, 8000, 32000}) {
    const PointSurface s(cloud_of_sphere(count, 0));
    Random random;
    double worst = 0, moved = 0, tilt = 0;
    const double spacing = std::sqrt(4 * kPi / double(count));
    for (int i = 0; i < 500; i++) {
      const Vec3 v = random.direction();
      const MlsPoint p = s.project(v * (1 + 0.5 * spacing * (random.uniform() - 0.5)), v);
      ASSERT_TRUE(p.found);
      worst = std::max(worst, std::fabs(p.position.norm() - 1));
      tilt = std::max(tilt, std::acos(std::min(1.0, p.normal.dot(v))));
      moved = std::max(moved, (s.project(p.position, p.normal).position - p.position).norm());
    }
    EXPECT_LT(worst, 0.02 * spacing * spacing) << count;
    EXPECT_LT(worst, last / 4) << count;  // four times the points: at least third order
    EXPECT_LT(moved, 0.3 * worst + 1e-9);
    EXPECT_LT(tilt, spacing);
    last = worst;
  }
}

// Figure 7: the line need not be normal to the surface.
TEST(MlsSurface, IntersectsLinesAtAnAngle) {
  const TriangleMesh cloud = cloud_of_sphere(8000, 0);
  const PointSurface s(cloud);
  std::vector<double> reach(s.cloud().spacing);
  for (double& r : reach) r *= 2.6;
  const MlsSurface mls(s.tree(), s.cloud().normals, reach);
  const Vec3 up(0, 0, 1);
  for (double radius = 0; radius < 0.95; radius += 0.05) {
    const Vec3 on(radius * std::cos(radius * 9), radius * std::sin(radius * 9),
                  std::sqrt(1 - radius * radius));
    const MlsPoint p = mls.intersect(on + 0.03 * up, up, on);
    ASSERT_TRUE(p.found);
    EXPECT_NEAR(p.position.z(), on.z(), 1e-4) << radius;
    EXPECT_EQ((p.position - on).head<2>().norm(), 0);
  }
}

TEST(PointSurface, KnowsItsNoise) {
  for (double noise : {0.001, 0.01}) {
    const PointSurface s(cloud_of_sphere(20000, noise * kSphereDiagonal));
    EXPECT_NEAR(s.noise(), noise * kSphereDiagonal, 0.1 * noise * kSphereDiagonal);
  }
  EXPECT_LT(PointSurface(cloud_of_sphere(20000, 0)).noise(), 1e-5);
}

// A cloud coded and decoded, against the true surface.
struct Trip {
  EncodeResult result;
  double error = 0, farthest = 0;  // E, both ways
  Topology topology;
};

Trip trip(const TriangleMesh& cloud, const TriangleMesh& truth, double error) {
  Trip t;
  EncodeOptions options;
  options.error = error * kE;
  t.result = encode(cloud, options);
  const TriangleMesh mesh = decode(t.result.stream.data(), t.result.stream.size());
  const SurfaceError e = ErrorMeter(truth, 100000).measure(mesh);
  t.error = e.rms / e.diagonal / kE;
  t.farthest = e.max / e.diagonal / kE;
  t.topology = topology(mesh);
  std::printf("%6zu points: E_rms %.2f, farthest %.1f, loops %zu, %zu bytes\n", cloud.positions.size(),
              t.error, t.farthest, size_t(t.topology.boundary_loops), t.result.stream.size());
  return t;
}

void expect_closed(const Trip& t, uint64_t components, int64_t genus) {
  EXPECT_EQ(t.topology.components, components);
  EXPECT_EQ(t.topology.genus, genus);
  EXPECT_EQ(t.topology.open_edges, 0u);
  EXPECT_EQ(t.topology.nonmanifold_edges, 0u);
}

TEST(Points, SphereWithAndWithoutNoise) {
  const TriangleMesh truth = make_sphere(6);
  struct Case {
    double noise, target, most;  // of the diagonal; E
  };
  // noise of E = 10 and 100
  for (const Case& c : {Case{0, 1, 1.1}, Case{0.001, 2, 5}, Case{0.01, 5, 16}}) {
    const Trip t = trip(cloud_of_sphere(15000, c.noise * kSphereDiagonal), truth, c.target);
    EXPECT_LT(t.error, c.most) << c.noise;
    EXPECT_LT(t.farthest, 12 * c.most) << c.noise;
    EXPECT_TRUE(t.result.target_met);
    expect_closed(t, 1, 0);
  }
}

TEST(Points, TorusWithNoise) {
  const TriangleMesh truth = make_torus(300, 120);
  for (double noise : {0.001, 0.01}) {
    const Trip t = trip(cloud_of_torus(20000, noise * 2.93), truth, noise * 2000);
    EXPECT_LT(t.error, noise == 0.001 ? 5 : 40) << noise;
    expect_closed(t, 1, 1);
  }
}

TEST(Points, DensityOfTenToOne) {
  const TriangleMesh cloud =
      cloud_of_sphere(15000, 0, [](const Vec3& v) { return 0.1 + 0.9 * (v.z() + 1) / 2; });
  const Trip t = trip(cloud, make_sphere(6), 1);
  EXPECT_LT(t.error, 1.4);
  expect_closed(t, 1, 0);
}

TEST(Points, OutliersAreLeftOut) {
  for (double noise : {0.0, 0.001}) {
    TriangleMesh cloud = cloud_of_sphere(15000, noise * kSphereDiagonal);
    Random random;
    for (int i = 0; i < 750; i++)
      add(cloud, 2 * Vec3(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5));
    const Trip t = trip(cloud, make_sphere(6), 3);
    EXPECT_LT(t.error, 6) << noise;
    EXPECT_LT(t.farthest, 120) << noise;  // those nearest to the surface make bumps
    expect_closed(t, 1, 0);
  }
}

TEST(Points, CloseSheetsStayApart) {
  const TriangleMesh inner = cloud_of_sphere(
      15000, 0, [](const Vec3&) { return 1.0; }, 0.9);  // 3.7 spacings apart
  const Trip t =
      trip(joined(cloud_of_sphere(18000, 0), inner), joined(make_sphere(6), flipped(make_sphere(6, 0.9))), 1);
  EXPECT_LT(t.error, 1.3);
  expect_closed(t, 2, 0);
}

TEST(Points, RimOfAHalfSphereIsKept) {
  const TriangleMesh truth = make_hemisphere(100, 400);
  const auto upper = [](const Vec3& v) { return v.z() >= 0 ? 1.0 : 0.0; };
  const double spacing = std::sqrt(2 * kPi / 12000);
  for (double noise : {0.0, 0.001, 0.01}) {
    const Trip t = trip(cloud_of_sphere(12000, noise * 3, upper), truth, 2 + noise * 500);
    EXPECT_EQ(t.topology.boundary_loops, 1u) << noise;
    EXPECT_EQ(t.topology.components, 1u) << noise;
    EXPECT_EQ(t.topology.genus, 0) << noise;
    // at the rim, half a spacing of the sphere may be bare or too much
    EXPECT_LT(t.error, noise < 0.01 ? 8 : 60) << noise;
    EXPECT_LT(t.farthest * kE * 3, noise < 0.01 ? 2 * spacing : 6 * spacing) << noise;
  }
}

TEST(Points, RealHolesAreKept) {
  // a window of 14 spacings in a sphere
  const TriangleMesh cloud =
      cloud_of_sphere(15000, 0, [](const Vec3& v) { return v.z() < 0.98 ? 1.0 : 0.0; });
  const Trip t = trip(cloud, make_sphere(6), 2);
  EXPECT_EQ(t.topology.boundary_loops, 1u);
  EXPECT_EQ(t.topology.components, 1u);
}

// The file's normals say which side is outside.
TEST(Points, NormalsOfTheFileAreKept) {
  TriangleMesh cloud = cloud_of_sphere(8000, 0);
  for (const auto& p : cloud.positions) cloud.normals.push_back({-p[0], -p[1], -p[2]});
  EncodeOptions options;
  options.error = 5 * kE;
  const EncodeResult result = encode(cloud, options);
  const TriangleMesh mesh = decode(result.stream.data(), result.stream.size());
  for (size_t i = 0; i < mesh.positions.size(); i++) {
    const auto &p = mesh.positions[i], &n = mesh.normals[i];
    EXPECT_LT(p[0] * n[0] + p[1] * n[1] + p[2] * n[2], 0);
  }
}

TEST(Points, RefusesWhatIsNoSurface) {
  auto refusal = [](const TriangleMesh& cloud) {
    try {
      encode(cloud, {});
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  TriangleMesh few = cloud_of_sphere(9, 0);
  EXPECT_EQ(refusal(few), "has too few points for a surface");
  TriangleMesh same;
  same.positions.assign(1000, {1, 2, 3});
  EXPECT_EQ(refusal(same), "has too few points for a surface");
  TriangleMesh volume, line;
  Random random;
  for (int i = 0; i < 3000; i++) {
    add(volume, Vec3(random.uniform(), random.uniform(), random.uniform()));
    add(line, Vec3(random.uniform(), 0, 0));
  }
  EXPECT_EQ(refusal(volume), "its points lie on no surface");
  EXPECT_FALSE(refusal(line).empty());
}

// Of a place on the unit sphere.
std::array<double, 3> paint(const std::array<float, 3>& p) {
  return {128 + 100 * std::sin(4 * p[0]), 128 + 60 * p[1], 90 + 80 * p[2] * p[0]};
}

TriangleMesh painted_sphere(size_t points) {
  TriangleMesh cloud = cloud_of_sphere(points, 0);
  for (const auto& p : cloud.positions) {
    const auto c = paint(p);
    cloud.colors.push_back({uint8_t(c[0]), uint8_t(c[1]), uint8_t(c[2]), 255});
  }
  return cloud;
}

// rms, of what the vertices of a stream have against what they should
double error_of_paint(const TriangleMesh& decoded) {
  double sum = 0;
  for (size_t v = 0; v < decoded.positions.size(); v++)
    for (size_t k = 0; k < 3; k++) {
      const double d = double(decoded.colors[v][k]) - paint(decoded.positions[v])[k];
      sum += d * d / 3;
    }
  return std::sqrt(sum / double(decoded.positions.size()));
}

TEST(Points, ColoursComeBack) {
  EncodeOptions options;
  options.error = 4 * kE;
  size_t last = 0;
  for (double error : {8.0, 4.0, 2.0}) {
    options.color_error = error;
    const EncodeResult result = encode(painted_sphere(12000), options);
    EXPECT_TRUE(result.target_met);
    EXPECT_LE(result.color_error, error);
    EXPECT_GT(result.color_bytes, last) << error;
    last = result.color_bytes;
    for (bool points : {false, true}) {
      DecodeOptions decoding;
      decoding.points = points;
      const TriangleMesh decoded = decode(result.stream.data(), result.stream.size(), decoding);
      ASSERT_EQ(decoded.colors.size(), decoded.positions.size());
      EXPECT_LT(error_of_paint(decoded), error + 1) << error;
    }
  }
}

TEST(Points, ColoursKeepWithinABudget) {
  EncodeOptions options;
  options.bytes = 4000;
  const EncodeResult result = encode(painted_sphere(12000), options);
  EXPECT_TRUE(result.target_met);
  EXPECT_LE(result.stream.size(), options.bytes);
  EXPECT_GE(double(result.stream.size()), 0.98 * double(options.bytes));
  EXPECT_GT(result.color_bytes, 500u);
}

// What they do not need goes into the surface.
TEST(Points, PlainColoursLeaveTheBudgetToTheSurface) {
  TriangleMesh white = painted_sphere(12000);
  for (auto& c : white.colors) c = {255, 255, 255, 255};
  EncodeOptions options;
  options.bytes = 2000;
  const EncodeResult result = encode(white, options);
  EXPECT_TRUE(result.target_met);
  EXPECT_LE(result.stream.size(), options.bytes);
  EXPECT_GE(double(result.stream.size()), 0.98 * double(options.bytes));
  EXPECT_LT(result.color_bytes, 300u);
}

TEST(Points, ColoursCanBeLeftOut) {
  EncodeOptions options;
  options.error = 20 * kE;
  options.color_error = 0;
  const EncodeResult result = encode(painted_sphere(3000), options);
  EXPECT_EQ(result.color_bytes, 0u);
  TriangleMesh bare = painted_sphere(3000);
  bare.colors.clear();
  EXPECT_EQ(result.stream, encode(bare, options).stream);
  EXPECT_TRUE(decode(result.stream.data(), result.stream.size()).colors.empty());
}

// Of large triangles, the colours between the corners.
TEST(Colours, AreInterpolatedOverTriangles) {
  TriangleMesh cube = make_cube(2);
  auto colour = [](const std::array<float, 3>& p) {
    return std::array<double, 3>{128 + 90.0 * p[0], 128 + 90.0 * p[1], 128 + 90.0 * p[2]};
  };
  for (const auto& p : cube.positions) {
    const auto c = colour(p);
    cube.colors.push_back({uint8_t(c[0]), uint8_t(c[1]), uint8_t(c[2]), 255});
  }
  EncodeOptions options;
  options.error = 5e-4;
  options.color_error = 1;
  const EncodeResult result = encode(cube, options);
  const TriangleMesh decoded = decode(result.stream.data(), result.stream.size());
  ASSERT_GT(decoded.positions.size(), 10 * cube.positions.size());
  size_t off = 0;
  for (size_t v = 0; v < decoded.positions.size(); v++)
    for (size_t k = 0; k < 3; k++)
      off += std::fabs(double(decoded.colors[v][k]) - colour(decoded.positions[v])[k]) > 8;
  EXPECT_LT(double(off), 0.01 * 3 * double(decoded.positions.size()));
}

}  // namespace
}  // namespace relief
