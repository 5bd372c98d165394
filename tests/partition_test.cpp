// Partition of surfaces into height fields (paper, 3.2 and 3.3): what it promises, measured on analytic
// shapes.
#include "partition/partition.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <random>
#include <set>

#include "partition/boundary_shape.h"
#include "partition/connected.h"
#include "partition/enclosing_cone.h"
#include "partition/gla.h"
#include "partition/label_diffusion.h"
#include "partition/merge.h"
#include "partition/overlap.h"
#include "partition/split_merge.h"
#include "shapes.h"
#include "surface/import.h"

namespace relief {
namespace {

constexpr double kAperture = 80, kSlack = 4;  // degrees; the slack of partition.cpp for smooth boundaries

double cosine(double degrees) { return std::cos(degrees * M_PI / 180); }

double mean_spacing(const Surface& s) {
  return std::sqrt(s.total_area / static_cast<double>(s.vertices.size()));
}

int count_pieces(const Surface& surface, const std::vector<int>& label) {
  std::vector<char> seen(label.size(), 0);
  int pieces = 0;
  for (size_t f = 0; f < label.size(); ++f) {
    if (seen[f] || label[f] < 0) continue;
    ++pieces;
    std::vector<int> stack{static_cast<int>(f)};
    seen[f] = 1;
    while (!stack.empty()) {
      const int g = stack.back();
      stack.pop_back();
      for (int h : surface.adjacent[g])
        if (h >= 0 && !seen[h] && label[h] == label[g]) {
          seen[h] = 1;
          stack.push_back(h);
        }
    }
  }
  return pieces;
}

void expect_labelled(const Surface& surface, const Partition& partition) {
  std::vector<int> used(partition.normal.size(), 0);
  for (size_t f = 0; f < surface.faces.size(); ++f) {
    ASSERT_LT(partition.label[f], static_cast<int>(partition.normal.size()));
    if (surface.component_area[surface.component[f]] > 0)
      ASSERT_GE(partition.label[f], 0) << "face " << f << " is in no patch";
    else
      ASSERT_EQ(partition.label[f], -1);
    if (partition.label[f] >= 0) ++used[partition.label[f]];
  }
  for (size_t p = 0; p < used.size(); ++p) EXPECT_GT(used[p], 0) << "patch " << p << " is empty";
}

void expect_planes_are_averages(const Surface& surface, const Partition& partition) {
  std::vector<Vec3> sum(partition.normal.size(), Vec3::Zero());
  for (size_t f = 0; f < surface.faces.size(); ++f)
    if (partition.label[f] >= 0) sum[partition.label[f]] += surface.normals[f] * surface.areas[f];
  for (size_t p = 0; p < sum.size(); ++p) {
    EXPECT_NEAR(partition.normal[p].norm(), 1, 1e-9);
    EXPECT_NEAR(sum[p].normalized().dot(partition.normal[p]), 1, 1e-9) << "patch " << p;
  }
}

// No connected region of a patch beyond the tolerance is outside of the cone.
void expect_cones(const Surface& surface, const std::vector<int>& label, const std::vector<Vec3>& normal,
                  double aperture) {
  const NormalCone cone = make_normal_cone(surface, aperture);
  const FaceLists lists = faces_by_patch(label, normal.size());
  std::vector<int> mark(label.size(), -1);
  for (int p = 0; p < static_cast<int>(normal.size()); ++p)
    for (const FoldedRegion& r :
         folded_regions(cone, label, p, lists.begin(p), lists.end(p), normal[p], mark, 0))
      ADD_FAILURE() << "patch " << p << " has " << r.area / surface.total_area
                    << " of the surface outside of " << aperture << " degrees";
}

void expect_height_fields(const Surface& surface, const Partition& partition, double spacing) {
  const FaceLists lists = faces_by_patch(partition.label, partition.normal.size());
  for (int p = 0; p < static_cast<int>(partition.normal.size()); ++p)
    EXPECT_LE(find_overlap(surface, lists.begin(p), lists.end(p), partition.normal[p], spacing).pixels, 5)
        << "patch " << p << " covers pixels twice";
}

// Everything that partition.h promises.
Partition checked_partition(const Surface& surface, double aperture = kAperture,
                            Clustering clustering = Clustering::kLloyd, Plane plane = Plane::kAverage) {
  PartitionOptions options;
  options.aperture = aperture;
  options.clustering = clustering;
  options.plane = plane;
  const Partition partition = partition_surface(surface, options);
  EXPECT_EQ(partition.label.size(), surface.faces.size());
  expect_labelled(surface, partition);
  EXPECT_EQ(count_pieces(surface, partition.label), static_cast<int>(partition.normal.size()));
  if (plane == Plane::kAverage) expect_planes_are_averages(surface, partition);
  expect_cones(surface, partition.label, partition.normal, aperture + kSlack);
  expect_height_fields(surface, partition, mean_spacing(surface));
  return partition;
}

// The strict form of 3.2 for shapes without noise: every single face within the aperture (plus slack).
void expect_strict_cones(const Surface& surface, const Partition& partition, double aperture) {
  for (size_t f = 0; f < surface.faces.size(); ++f)
    EXPECT_GE(surface.normals[f].dot(partition.normal[partition.label[f]]), cosine(aperture)) << "face " << f;
}

TEST(Partition, SphereTakesAFewPatches) {
  const Surface surface = build_surface(make_sphere(6));
  const Partition partition = checked_partition(surface);
  EXPECT_GE(partition.normal.size(), 3u);  // two cones of 84 degrees cannot cover a sphere
  EXPECT_LE(partition.normal.size(), 8u);
  expect_strict_cones(surface, partition, kAperture + kSlack + 1);
}

TEST(Partition, ATightApertureTakesMorePatches) {
  const Surface surface = build_surface(make_sphere(5));
  const size_t wide = checked_partition(surface, 80).normal.size();
  const size_t tight = checked_partition(surface, 30).normal.size();
  // A cone of 34 degrees covers (1 - cos 34) / 2 = 8.5% of the sphere.
  EXPECT_GE(tight, 12u);
  EXPECT_GT(tight, wide);
}

TEST(Partition, Torus) {
  const Surface surface = build_surface(make_torus(200, 100));
  const Partition partition = checked_partition(surface);
  EXPECT_GE(partition.normal.size(), 4u);
  EXPECT_LE(partition.normal.size(), 12u);
}

TEST(Partition, CubeWithSubdividedSides) {
  const Surface surface = build_surface(make_cube(40));
  const Partition partition = checked_partition(surface);
  // Three sides around a corner lie within 54.7 degrees of the diagonal: two patches would do.
  EXPECT_GE(partition.normal.size(), 2u);
  EXPECT_LE(partition.normal.size(), 8u);
}

TEST(Partition, CubeOfTwelveTriangles) {
  const Surface surface = build_surface(make_cube(1));
  const Partition partition = checked_partition(surface);
  EXPECT_GE(partition.normal.size(), 2u);
  EXPECT_LE(partition.normal.size(), 6u);
  expect_strict_cones(surface, partition, kAperture + kSlack);
}

TEST(Partition, BothSidesOfAThinPlateAreApart) {
  const Surface surface = build_surface(make_plate(60));
  const Partition partition = checked_partition(surface);
  EXPECT_GE(partition.normal.size(), 2u);
  std::set<int> up, down;
  for (size_t f = 0; f < surface.faces.size(); ++f) {
    if (surface.normals[f].z() > 0.9) up.insert(partition.label[f]);
    if (surface.normals[f].z() < -0.9) down.insert(partition.label[f]);
  }
  for (int p : up) EXPECT_EQ(down.count(p), 0u);
}

TEST(Partition, BumpySphere) {
  const Surface surface = build_surface(make_bumpy_sphere(6));
  EXPECT_GE(checked_partition(surface).normal.size(), 3u);
}

TEST(Partition, FlatSheetIsOnePatch) {
  const Surface surface = build_surface(make_waves(100));
  EXPECT_EQ(checked_partition(surface).normal.size(), 1u);
}

// A ramp that winds three times around the z axis: all normals are close to it, yet it covers itself thrice.
TEST(Partition, SpiralRampIsSplitWhereItCoversItself) {
  const Surface surface =
      build_surface(mapped(make_height_field(300, [](double, double) { return 0.0; }), [](auto p) {
        const double turn = 3 * shapes::kPi * p[0], r = 1.5 + 0.5 * p[1];
        return shapes::Point{r * std::sin(turn), r * std::cos(turn), 0.2 * turn};
      }));
  const NormalCone cone = make_normal_cone(surface, kAperture);
  const FaceLists all = faces_by_patch(std::vector<int>(surface.faces.size(), 0), 1);
  const Vec3 axis = surface.normals[0].z() > 0 ? Vec3::UnitZ() : Vec3(-Vec3::UnitZ());
  ASSERT_GT(aperture_cosine(cone, all.begin(0), all.end(0), axis), cosine(kAperture));
  ASSERT_GT(find_overlap(surface, all.begin(0), all.end(0), axis, mean_spacing(surface)).pixels, 1000);
  EXPECT_GE(checked_partition(surface).normal.size(), 3u);
}

TEST(Partition, SwissRoll) {
  const Surface surface =
      build_surface(mapped(make_height_field(300, [](double, double) { return 0.0; }), [](auto p) {
        const double turn = 2.5 * shapes::kPi * (p[0] + 1), r = 0.3 + 0.1 * turn;
        return shapes::Point{r * std::sin(turn), r * std::cos(turn), 2 * p[1]};
      }));
  // 900 degrees in sectors of at most 168.
  EXPECT_GE(checked_partition(surface).normal.size(), 6u);
}

TEST(Partition, ClosedComponentsAreNeverOnePatch) {
  const Surface surface = build_surface(joined(make_nested_spheres(4), moved(make_sphere(2, 0.01), 3, 0, 0)));
  const Partition partition = checked_partition(surface);
  std::vector<std::set<int>> patches(surface.component_area.size());
  for (size_t f = 0; f < surface.faces.size(); ++f) patches[surface.component[f]].insert(partition.label[f]);
  ASSERT_EQ(patches.size(), 3u);
  for (const auto& p : patches) EXPECT_GE(p.size(), 2u);
}

TEST(Partition, ManyTinyComponents) {
  TriangleMesh mesh;
  const int side = 22;
  for (int i = 0; i < side * side * side; ++i) {
    const float x = float(i % side), y = float(i / side % side), z = float(i / side / side);
    const uint32_t base = uint32_t(mesh.positions.size());
    const std::vector<std::array<float, 3>> corners = {
        {x, y, z}, {x + 0.4f, y, z}, {x, y + 0.4f, z}, {x, y, z + 0.4f}};
    mesh.positions.insert(mesh.positions.end(), corners.begin(), corners.end());
    mesh.triangles.push_back({base, base + 1, base + 2});
    if (i % 2) continue;  // every other one is a closed tetrahedron
    mesh.triangles.back() = {base, base + 2, base + 1};
    mesh.triangles.push_back({base, base + 1, base + 3});
    mesh.triangles.push_back({base + 1, base + 2, base + 3});
    mesh.triangles.push_back({base + 2, base, base + 3});
  }
  const Surface surface = build_surface(mesh);
  ASSERT_EQ(surface.component_area.size(), 10648u);
  const Partition partition = checked_partition(surface);
  EXPECT_GE(partition.normal.size(), 10648u / 2 * 3);  // at least two for a tetrahedron
  expect_strict_cones(surface, partition, kAperture + kSlack);
}

TEST(Partition, SingleTriangle) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  const Partition partition = partition_surface(build_surface(mesh), {});
  ASSERT_EQ(partition.label, std::vector<int>{0});
  EXPECT_NEAR(partition.normal[0].z(), 1, 1e-12);
}

// A face without area in a strip takes a neighbour's label; a component without area has no patch.
TEST(Partition, FacesWithoutArea) {
  Surface surface;
  surface.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 1, 0}, {5, 5, 5}, {6, 6, 6}, {7, 7, 7}};
  surface.faces = {{0, 2, 3}, {0, 1, 2}, {4, 5, 6}};
  surface.adjacent = {{1, -1, -1}, {-1, -1, 0}, {-1, -1, -1}};
  surface.normals = {{0, 0, 1}, {0, 0, 0}, {0, 0, 0}};
  surface.areas = {1, 0, 0};
  surface.component = {0, 0, 1};
  surface.component_area = {1, 0};
  surface.total_area = 1;
  for (const Clustering clustering : {Clustering::kLloyd, Clustering::kSplitMerge})
    for (const Plane plane : {Plane::kAverage, Plane::kCone}) {
      PartitionOptions options;
      options.clustering = clustering;
      options.plane = plane;
      const Partition partition = partition_surface(surface, options);
      EXPECT_EQ(partition.label, (std::vector<int>{0, 0, -1}));
      EXPECT_NEAR(partition.normal[0].z(), 1, 1e-12);
    }
}

TEST(Partition, SameOnAnyNumberOfThreads) {
  const Surface surface = build_surface(make_bumpy_sphere(6, 0.15, 13));
  for (const Clustering clustering : {Clustering::kLloyd, Clustering::kSplitMerge}) {
    Partition results[2];
    for (int threads : {1, 2}) {
      tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
      PartitionOptions options;
      options.clustering = clustering;
      results[threads - 1] = partition_surface(surface, options);
    }
    EXPECT_EQ(results[0].label, results[1].label);
    EXPECT_EQ(results[0].normal, results[1].normal);
  }
}

TEST(Partition, ProgressNeverFalls) {
  PartitionOptions options;
  std::vector<double> seen;
  options.progress = [&](double done) { seen.push_back(done); };
  partition_surface(build_surface(make_torus(60, 30)), options);
  ASSERT_FALSE(seen.empty());
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_EQ(seen.back(), 1);
}

TEST(Lloyd, PatchesSatisfyTheConeExactly) {
  for (const TriangleMesh& mesh : {make_bumpy_sphere(5, 0.15, 13), make_torus(200, 100), make_cube(30)}) {
    const Surface surface = build_surface(mesh);
    const NormalCone cone = make_normal_cone(surface, 60);
    const Patches patches = generalized_lloyd(cone, surface, [](double) {});
    expect_cones(surface, patches.label, patches.normal, 60);
  }
}

std::vector<TriangleMesh> various_shapes() {
  return {make_sphere(5),       make_bumpy_sphere(6, 0.15, 13),
          make_torus(200, 100), make_cube(1),
          make_cube(30),        make_plate(60),
          make_waves(60),       joined(make_nested_spheres(4), moved(make_sphere(2, 0.01), 3, 0, 0))};
}

// Without smoother boundaries: no slack, every patch connected, every face in one.
TEST(SplitMerge, PatchesSatisfyTheConeExactly) {
  for (const double aperture : {30.0, 60.0, 89.0})
    for (const TriangleMesh& mesh : various_shapes()) {
      const Surface surface = build_surface(mesh);
      const Patches patches = split_merge(make_normal_cone(surface, aperture), surface, 20);
      expect_labelled(surface, {patches.label, patches.normal});
      expect_cones(surface, patches.label, patches.normal, aperture);
      EXPECT_EQ(count_pieces(surface, patches.label), static_cast<int>(patches.normal.size()));
    }
}

TEST(SplitMerge, KeepsWhatAPartitionPromises) {
  for (const TriangleMesh& mesh : various_shapes())
    checked_partition(build_surface(mesh), kAperture, Clustering::kSplitMerge);
}

// 3.3: a small alpha leads to many clusters, which merging under a larger beta makes few; with beta = alpha
// far more stay.
TEST(SplitMerge, MergingLeavesFewPatches) {
  const Surface surface = build_surface(make_bumpy_sphere(6, 0.15, 13));
  const auto count = [&](double alpha, double beta) {
    return split_merge(make_normal_cone(surface, beta), surface, alpha).normal.size();
  };
  const size_t narrow = count(10, 10), merged = count(10, 80), coarse = count(60, 80);
  EXPECT_GE(narrow, 132u);  // cones of 10 degrees that cover a sphere
  EXPECT_LE(merged, narrow / 10);
  EXPECT_LE(coarse, narrow / 10);
  EXPECT_GE(std::min(merged, coarse), 3u);
}

TEST(SplitMerge, FlatIsOnePatch) {
  const Surface surface = build_surface(make_waves(60));
  EXPECT_EQ(split_merge(make_normal_cone(surface, kAperture), surface, 5).normal.size(), 1u);
}

// The queue takes the cheapest pair first: of three strips in a row, the middle one joins the side it is more
// alike.
TEST(SplitMerge, TheCheapestPairIsMergedFirst) {
  const Surface surface = build_surface(make_height_field(30, [](double x, double) {
    return x < -1.0 / 3 ? 0.0 : x < 1.0 / 3 ? 0.2 * (x + 1.0 / 3) : 0.2 * 2 / 3 + 1.2 * (x - 1.0 / 3);
  }));
  Patches strips;
  for (const Vec3& n : surface.normals) strips.label.push_back(n.z() > 0.99 ? 0 : n.z() > 0.9 ? 1 : 2);
  strips.normal.assign(3, Vec3::UnitZ());
  ASSERT_EQ(count_pieces(surface, strips.label), 3);
  refit(surface, strips);
  NormalCone cone = make_normal_cone(surface, 22);  // any two neighbours fit into it, all three do not
  merge_cheapest(cone, surface, strips);
  EXPECT_EQ(strips.normal.size(), 2u);
  std::set<int> of[3];
  for (size_t f = 0; f < surface.faces.size(); ++f) {
    const double z = surface.normals[f].z();
    of[z > 0.99 ? 0 : z > 0.9 ? 1 : 2].insert(strips.label[f]);
  }
  EXPECT_EQ(of[0], of[1]);
  EXPECT_NE(of[1], of[2]);
}

// The largest cosine of a cone around these normals: its rim holds two opposite, or three.
double best_cosine(const std::vector<Vec3>& n) {
  double best = 0;
  const auto consider = [&](Vec3 axis, const Vec3& rim) {
    if (axis.norm() < 1e-12) return;
    axis.normalize();
    if (axis.dot(rim) < 0) axis = -axis;
    double least = 1;
    for (const Vec3& m : n) least = std::min(least, axis.dot(m));
    best = std::max(best, least);
  };
  for (size_t i = 0; i < n.size(); ++i) {
    consider(n[i], n[i]);
    for (size_t j = 0; j < i; ++j) {
      consider(n[i] + n[j], n[i]);
      for (size_t k = 0; k < j; ++k) consider((n[j] - n[i]).cross(n[k] - n[i]), n[i]);
    }
  }
  return best;
}

Vec3 random_direction(std::mt19937& random, const Vec3& around, double spread) {
  std::uniform_real_distribution<double> u(-1, 1);
  const Vec3 offset(u(random), u(random), u(random));
  return (around + spread * offset).normalized();
}

TEST(EnclosingCone, IsTheSmallestOne) {
  std::mt19937 random(7);
  int without = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 around = random_direction(random, Vec3::Zero(), 1);
    const double spread = std::pow(10, 1 - 4.0 * (trial % 10) / 9);  // 10: all over the sphere, to 0.001
    std::vector<Vec3> normals;
    for (int i = 0; i < 1 + trial % 14; ++i) normals.push_back(random_direction(random, around, spread));
    if (trial % 3 == 0) normals.push_back(normals[0]);  // twice the same
    const EnclosingCone cone = smallest_enclosing_cone(normals);
    const double best = best_cosine(normals);
    if (best < 1e-5) {
      EXPECT_LT(cone.cosine, 1e-5);
      ++without;
      continue;
    }
    EXPECT_NEAR(cone.cosine, best, 1e-10) << "trial " << trial;
    EXPECT_NEAR(cone.axis.norm(), 1, 1e-12);
    for (const Vec3& n : normals) EXPECT_GE(n.dot(cone.axis), cone.cosine);
  }
  EXPECT_GT(without, 20);
}

TEST(EnclosingCone, ManyNormalsOfACapAndDegenerateSets) {
  std::mt19937 random(3);
  const double aperture = 70;
  std::vector<Vec3> cap;
  for (int i = 0; i < 100000; ++i) {  // the rim is hit by every tenth
    const double t =
        i % 10 ? std::acos(1 - (1 - cosine(aperture)) * (random() / 4294967296.0)) : aperture * M_PI / 180;
    const double u = 2 * M_PI * (random() / 4294967296.0);
    cap.push_back(Vec3(std::sin(t) * std::cos(u), std::cos(t), std::sin(t) * std::sin(u)));
  }
  const EnclosingCone cone = smallest_enclosing_cone(cap);
  EXPECT_NEAR(cone.cosine, cosine(aperture), 1e-7);
  EXPECT_NEAR(cone.axis.y(), 1, 1e-10);

  EXPECT_EQ(smallest_enclosing_cone({}).axis, Vec3::Zero());
  EXPECT_NEAR(smallest_enclosing_cone({Vec3::UnitX()}).cosine, 1, 1e-12);
  EXPECT_EQ(smallest_enclosing_cone({Vec3::UnitX(), -Vec3::UnitX()}).axis, Vec3::Zero());
  const std::vector<Vec3> axes = {Vec3::UnitX(), -Vec3::UnitX(), Vec3::UnitY(), -Vec3::UnitY(),
                                  Vec3::UnitZ()};
  EXPECT_EQ(smallest_enclosing_cone(axes).cosine, 0);
}

// Planes by the smallest cone keep every promise; of a shape without noise no patch's aperture is wider for
// it.
TEST(Partition, PlanesBySmallestCones) {
  for (const TriangleMesh& mesh : various_shapes()) {
    const Surface surface = build_surface(mesh);
    const Partition average = checked_partition(surface);
    const Partition cones = checked_partition(surface, kAperture, Clustering::kLloyd, Plane::kCone);
    ASSERT_EQ(cones.label, average.label);
    const NormalCone cone = make_normal_cone(surface, kAperture);
    const FaceLists lists = faces_by_patch(average.label, average.normal.size());
    for (int p = 0; p < static_cast<int>(average.normal.size()); ++p) {
      double by_average = 1, by_cone = 1;
      for (const int* f = lists.begin(p); f != lists.end(p); ++f) {
        const Vec3 n = cone.cells.smooth[*f].cast<double>();
        by_average = std::min(by_average, n.dot(average.normal[p]));
        by_cone = std::min(by_cone, n.dot(cones.normal[p]));
      }
      EXPECT_GE(by_cone, by_average - 1e-6);
    }
  }
}

// Equation (4) by its definition: a cube's sides over their own planes cost nothing; over one plane for all
// of a patch around a corner, 2 - 2 / sqrt(3).
TEST(Partition, Cost) {
  const Surface surface = build_surface(make_cube(10));
  std::vector<int> sides, corners;
  for (const Vec3& n : surface.normals) {
    int axis;
    n.cwiseAbs().maxCoeff(&axis);
    sides.push_back(2 * axis + (n[axis] > 0));
    corners.push_back(n[axis] > 0);
  }
  std::vector<Vec3> plane(6, Vec3::Zero());
  for (size_t f = 0; f < sides.size(); ++f) plane[sides[f]] = surface.normals[f];
  EXPECT_NEAR(partition_cost(surface, {sides, plane}), 0, 1e-12);
  const Vec3 corner = Vec3(1, 1, 1).normalized();
  EXPECT_NEAR(partition_cost(surface, {corners, {-corner, corner}}), 2 - 2 / std::sqrt(3), 1e-9);
}

// A patch for each side of a cube.
Patches cube_sides(const Surface& surface) {
  Patches patches;
  patches.normal.assign(6, Vec3::Zero());
  for (const Vec3& n : surface.normals) {
    int axis;
    n.cwiseAbs().maxCoeff(&axis);
    patches.label.push_back(2 * axis + (n[axis] > 0));
  }
  refit(surface, patches);
  return patches;
}

TEST(BoundaryShape, DecreasesTheLengthAndKeepsTheConditions) {
  const Surface surface = build_surface(make_bumpy_sphere(6));
  const NormalCone cone = make_normal_cone(surface, kAperture);
  Patches patches = generalized_lloyd(cone, surface, [](double) {});
  const double before = boundary_length(surface, patches.label);
  const int pieces = count_pieces(surface, patches.label);
  const size_t count = patches.normal.size();
  const double decrease = optimize_boundary_shape(cone, surface, patches, cone.cosine);
  const double after = boundary_length(surface, patches.label);
  EXPECT_LT(after, 0.9 * before);
  EXPECT_NEAR(before - after, decrease, 1e-9 * before);
  EXPECT_EQ(count_pieces(surface, patches.label), pieces);
  EXPECT_EQ(patches.normal.size(), count);
  expect_cones(surface, patches.label, patches.normal, kAperture + 1);
}

TEST(BoundaryShape, StraightensRaggedEdges) {
  const Surface surface = build_surface(make_cube(30));
  const NormalCone cone = make_normal_cone(surface, 89);
  Patches patches = cube_sides(surface);
  const double straight = 12 * kLatticeDiagonal / std::sqrt(3);  // twelve edges
  ASSERT_NEAR(boundary_length(surface, patches.label), straight, 1e-6 * straight);
  const std::vector<int> sides = patches.label;
  for (size_t f = 0; f < sides.size(); f += 7)
    for (int g : surface.adjacent[f])
      if (sides[g] != sides[f]) patches.label[f] = sides[g];
  EXPECT_GT(boundary_length(surface, patches.label), 1.05 * straight);
  optimize_boundary_shape(cone, surface, patches, -1);
  EXPECT_LE(boundary_length(surface, patches.label), 1.0001 * straight);
}

TEST(LabelDiffusion, ShortensBoundariesAcrossAFlatSheet) {
  const Surface surface = build_surface(make_waves(100));
  const NormalCone cone = make_normal_cone(surface, kAperture);
  Patches patches;
  patches.normal.assign(2, Vec3::UnitZ());
  const double unit = kLatticeDiagonal / 3;
  for (const auto& t : surface.faces) {  // a border like a saw, with teeth of eight faces
    const Vec3& p = surface.vertices[t[0]];
    patches.label.push_back(p.x() > 0.12 * unit * std::abs(std::fmod(p.y() / (0.16 * unit) + 100, 2) - 1));
  }
  refit(surface, patches);
  const double before = boundary_length(surface, patches.label);
  diffuse_labels(cone, surface, patches, cone.cosine, 4, 24);
  optimize_boundary_shape(cone, surface, patches, cone.cosine);
  EXPECT_LT(boundary_length(surface, patches.label), 0.75 * before);
  EXPECT_EQ(count_pieces(surface, patches.label), 2);
}

TEST(Merge, JoinsWhatFitsIntoOneCone) {
  const Surface surface = build_surface(make_waves(60));
  const NormalCone cone = make_normal_cone(surface, kAperture);
  Patches patches;
  for (size_t f = 0; f < surface.faces.size(); ++f) patches.label.push_back(static_cast<int>(f / 100));
  patches.normal.assign(surface.faces.size() / 100, Vec3::UnitZ());
  EXPECT_EQ(merge_patches(cone, surface, patches, {}), 71);
  EXPECT_EQ(patches.normal.size(), 1u);
  // A cube's sides at 50 degrees do not.
  const Surface cube = build_surface(make_cube(10));
  Patches sides = cube_sides(cube);
  EXPECT_EQ(merge_patches(make_normal_cone(cube, 40), cube, sides, {}), 0);
  EXPECT_EQ(sides.normal.size(), 6u);
}

TEST(Connect, StrayPiecesJoinANeighbourOrBecomePatches) {
  const Surface surface = build_surface(make_cube(20));
  const NormalCone cone = make_normal_cone(surface, 50);
  Patches patches = cube_sides(surface);
  // One face in the middle of +z is said to be of +x: its neighbours take it back. All of -x as well: becomes
  // a patch.
  for (size_t f = 0; f < surface.faces.size(); ++f) {
    const Vec3& p = surface.vertices[surface.faces[f][0]];
    if (patches.label[f] == 0) patches.label[f] = 1;
    if (patches.label[f] == 5 && p.head<2>().norm() < 1e-3 * kLatticeDiagonal) patches.label[f] = 1;
  }
  refit(surface, patches);
  EXPECT_GT(connect_patches(cone, surface, patches, cone.cosine), 1);
  EXPECT_EQ(count_pieces(surface, patches.label), 6);
  EXPECT_EQ(patches.normal.size(), 6u);
  expect_cones(surface, patches.label, patches.normal, 50);
}

TEST(Overlap, CountsPixelsCoveredTwice) {
  // Two unit squares facing up, one above the other.
  const TriangleMesh sheet = make_height_field(20, [](double, double) { return 0.0; });
  const Surface surface = build_surface(joined(sheet, moved(sheet, 1, 0, 0.5)));
  std::vector<int> all(surface.faces.size());
  for (size_t f = 0; f < all.size(); ++f) all[f] = static_cast<int>(f);
  const double spacing =
      0.1 * kLatticeDiagonal / std::sqrt(9 + 4 + 0.25);  // half of a pixel each way may be missed
  const Overlap o = find_overlap(surface, all.data(), all.data() + all.size(), Vec3::UnitZ(), spacing);
  EXPECT_NEAR(o.pixels, 10 * 20, 31);
  EXPECT_NE(surface.component[o.low], surface.component[o.high]);
  // From below nothing faces the plane.
  EXPECT_EQ(find_overlap(surface, all.data(), all.data() + all.size(), -Vec3::UnitZ(), spacing).pixels, 0);
}

TEST(Partition, Igea) {
  const char* path = RELIEF_SOURCE_DIR "/../shared/models/scan/igea.ply";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "skipped: no " << path;
  const Surface surface = build_surface(read_mesh(path));
  const Partition partition = checked_partition(surface);
  EXPECT_LE(partition.normal.size(), 10u);  // the paper's Table 2: 7
  EXPECT_LE(boundary_length(surface, partition.label), 9.5 * kLatticeDiagonal);
}

}  // namespace
}  // namespace relief
