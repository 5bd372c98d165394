#include "points/point_surface.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <unordered_map>

#include "points/point_normals.h"
#include "points/triangulate.h"
#include "surface/sets.h"
#include "surface/weld.h"

namespace relief {
namespace {

constexpr double kReach = 2.6;                // of the MLS weights where there is no noise, spacings
constexpr double kFlat = 0.1;                 // thickness over reach of a neighbourhood that has a plane
constexpr double kWider = 1.5, kWidest = 12;  // steps of the reach in search of one, and their end
constexpr double kNoiseFree = 0.05;   // rms distance from the surface that scans of no noise have, spacings
constexpr double kReachForNoise = 8;  // more reach for the square root of noise over spacing
constexpr double kFarOff = 0.75, kFarOffNoise = 5, kFarOffNear = 6;  // see leave_out_the_wrong
constexpr double kSmooth = 0.1;                    // error of the polynomials over that of planes
constexpr double kTooClose = 0.25;                 // points that add nothing, spacings
constexpr size_t kFewestPoints = 10, kSpeck = 32;  // triangles of a component

Vec3 vec(const std::array<float, 3>& p) { return {p[0], p[1], p[2]}; }

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + ptrdiff_t(v.size() / 2), v.end());
  return v[v.size() / 2];
}

// The median over some points, spread over all.
template <class Value>
double median_of_sample(size_t count, Value value) {
  constexpr size_t kMost = 4000;
  std::vector<double> v(std::min(count, kMost));
  tbb::parallel_for(size_t(0), v.size(), [&](size_t k) { v[k] = value(k * count / v.size()); });
  return median(std::move(v));
}

// Points in the air among others of their kind: few, and with neighbours on all sides.
std::vector<char> in_the_air(const Cloud& cloud, const KdTree& tree) {
  constexpr double kFew = 3;       // times the spacing of most points
  constexpr double kThick = 0.22;  // of their neighbourhood, over its radius
  const double most = median(cloud.spacing);
  std::vector<char> marked(cloud.points.size());
  tbb::parallel_for(size_t(0), marked.size(), [&](size_t i) {
    marked[i] =
        cloud.spacing[i] > kFew * most && plane_thickness(tree, i, kReach * cloud.spacing[i]) > kThick;
  });
  return marked;
}

// All but a greedy subset without pairs closer than kTooClose spacings.
std::vector<char> too_close(const Cloud& cloud, const KdTree& tree) {
  std::vector<char> marked(cloud.points.size(), 0);
  std::vector<Neighbour> near;
  for (size_t i = 0; i < marked.size(); i++) {
    if (marked[i]) continue;
    tree.within(cloud.points[i], kTooClose * cloud.spacing[i], near);
    for (const Neighbour& n : near)
      if (n.index != i && cloud.normals[n.index].dot(cloud.normals[i]) > 0) marked[n.index] = 1;
  }
  return marked;
}

// Leaves out pieces of a few triangles, connected by edges, but for the largest: what outliers make in the
// air, and what lies askew where sheets are too near for the points to tell them apart.
size_t drop_specks(std::vector<std::array<uint32_t, 3>>& triangles) {
  std::unordered_map<uint64_t, uint32_t> across;  // the triangle of each directed edge
  auto edge = [&](size_t t, size_t k) { return uint64_t(triangles[t][k]) << 32 | triangles[t][(k + 1) % 3]; };
  across.reserve(3 * triangles.size());
  for (size_t t = 0; t < triangles.size(); t++)
    for (size_t k = 0; k < 3; k++) across[edge(t, k)] = uint32_t(t);
  Sets sets(triangles.size());
  for (const auto& [directed, t] : across)
    if (const auto other = across.find(directed << 32 | directed >> 32); other != across.end())
      sets.join(t, other->second);
  std::vector<size_t> size(triangles.size(), 0);
  for (uint32_t t = 0; t < triangles.size(); t++) size[sets.find(t)]++;
  const size_t least = std::min(kSpeck, *std::max_element(size.begin(), size.end()));
  size_t kept = 0;
  for (uint32_t t = 0; t < triangles.size(); t++)
    if (size[sets.find(t)] >= least) triangles[kept++] = triangles[t];
  triangles.resize(kept);
  return size.size() - kept;
}

// A length as a fraction of the diagonal of the points' box.
std::string of_diagonal(double length, const std::vector<Vec3>& points) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : points) box.extend(p);
  char text[64];
  std::snprintf(text, sizeof text, "%.1e of the diagonal", length / box.diagonal().norm());
  return text;
}

}  // namespace

PointSurface::PointSurface(const TriangleMesh& cloud) {
  gather(cloud);
  leave_out_the_lonely();
  estimate_normals(!cloud.normals.empty());
  estimate_noise();
  leave_out_the_wrong();
  const Cloud on = resampled();
  mesh_.triangles = triangulate(on, KdTree(on.points));
  if (mesh_.triangles.empty()) throw InputError("its points lie on no surface");
  if (const size_t specks = drop_specks(mesh_.triangles))
    warnings_.push_back("left out " + std::to_string(specks) + " triangles of specks");
  for (const Vec3& p : on.points) mesh_.positions.push_back({float(p.x()), float(p.y()), float(p.z())});
}

// Each place once.
void PointSurface::gather(const TriangleMesh& cloud) {
  const std::vector<uint32_t> first = weld_positions(cloud.positions);
  for (size_t i = 0; i < first.size(); i++) {
    if (first[i] != i) continue;
    cloud_.points.push_back(vec(cloud.positions[i]));
    if (!cloud.normals.empty()) cloud_.normals.push_back(vec(cloud.normals[i]));
  }
  tree_ = std::make_unique<KdTree>(cloud_.points);
  leave_out(std::vector<char>(cloud_.points.size(), 0), "");
}

bool PointSurface::leave_out(const std::vector<char>& marked, const char* what) {
  constexpr size_t kMost = size_t(1) << 29;
  const auto count = std::count(marked.begin(), marked.end(), char(1));
  if (cloud_.points.size() - size_t(count) < kFewestPoints)
    throw InputError("has too few points for a surface");
  if (cloud_.points.size() > kMost) throw InputError("has too many points");
  if (count == 0) return false;
  remove_marked(cloud_.points, marked);
  if (!cloud_.normals.empty()) remove_marked(cloud_.normals, marked);
  if (!cloud_.spacing.empty()) remove_marked(cloud_.spacing, marked);
  if (!reach_.empty()) remove_marked(reach_, marked);
  tree_ = std::make_unique<KdTree>(cloud_.points);
  warnings_.push_back("left out " + std::to_string(count) + " point" + (count > 1 ? "s" : "") + " " + what);
  return true;
}

void PointSurface::leave_out_the_lonely() {
  constexpr int kRounds = 3;
  leave_out(outliers(*tree_), "far from all others");
  cloud_.spacing = spacings(*tree_);
  for (int round = 0; round < kRounds && leave_out(in_the_air(cloud_, *tree_), "in the air"); round++)
    cloud_.spacing = spacings(*tree_);
}

// Planes, as wide as it takes to see one through the noise; their sides from the file's normals or by
// propagation.
void PointSurface::estimate_normals(bool given) {
  double wide = kReach;
  auto thickness = [&](size_t i) { return plane_thickness(*tree_, i, wide * cloud_.spacing[i]); };
  double thick = median_of_sample(cloud_.points.size(), thickness);
  for (; thick > kFlat && wide < kWidest; thick = median_of_sample(cloud_.points.size(), thickness))
    wide *= kWider;
  if (thick > 2 * kFlat) throw InputError("its points lie on no surface");
  for (double s : cloud_.spacing) reach_.push_back(wide * s);
  std::vector<Vec3> normals = plane_normals(*tree_, reach_);
  given = given && std::all_of(cloud_.normals.begin(), cloud_.normals.end(),
                               [](const Vec3& n) { return n.allFinite() && n.squaredNorm() > 0; });
  if (given) {
    for (size_t i = 0; i < normals.size(); i++)
      if (normals[i].dot(cloud_.normals[i]) < 0) normals[i] = -normals[i];
  } else {
    orient_normals(*tree_, normals);
  }
  cloud_.normals = std::move(normals);
  mls_ = std::make_unique<MlsSurface>(*tree_, cloud_.normals, reach_);
}

// The more noise, the more points are to be heard.
void PointSurface::estimate_noise() {
  noise_ = median_of_sample(cloud_.points.size(), [&](size_t i) { return mls_->residual(i); });
  noisy_ = noise_ > kNoiseFree * median(cloud_.spacing);
  if (noisy_)
    warnings_.push_back("took for noise that its points are off their surface by " +
                        of_diagonal(noise_, cloud_.points));
  for (size_t i = 0; i < reach_.size(); i++) {
    const double excess = std::max(0.0, noise_ / cloud_.spacing[i] - kNoiseFree);
    reach_[i] = std::max(reach_[i], cloud_.spacing[i] * (kReach + kReachForNoise * std::sqrt(excess)));
  }
}

// Points off the surface of the others: by more than spacing and noise explain, and by much more than their
// neighbours, which at sharp features are off as well.
void PointSurface::leave_out_the_wrong() {
  const size_t count = cloud_.points.size();
  std::vector<double> off(count), off_plane(count);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, 64), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); i++) std::tie(off[i], off_plane[i]) = mls_->prediction(i);
  });
  smooth_ = median(off) < kSmooth * median(off_plane);
  std::vector<char> marked(count);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, 64), [&](const auto& range) {
    std::vector<Neighbour> near;
    for (size_t i = range.begin(); i < range.end(); i++) {
      if (off[i] <= kFarOff * cloud_.spacing[i] + kFarOffNoise * noise_) continue;
      tree_->nearest(cloud_.points[i], kNeighbours, near);
      std::vector<double> around;
      for (const Neighbour& n : near) around.push_back(off[n.index]);
      marked[i] = off[i] > kFarOffNear * median(std::move(around));
    }
  });
  leave_out(marked, "off the surface of the others");
  mls_ = std::make_unique<MlsSurface>(*tree_, cloud_.normals, reach_);
}

// The points on the surface, without those that are too close to others.
Cloud PointSurface::resampled() const {
  Cloud on = cloud_;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, on.points.size(), 64), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); i++) {
      const MlsPoint p = mls_->project(cloud_.points[i], cloud_.normals[i]);
      if (noisy_) on.points[i] = p.position;
      on.normals[i] = p.normal;
    }
  });
  const std::vector<char> close = too_close(on, KdTree(on.points));
  remove_marked(on.points, close);
  remove_marked(on.normals, close);
  on.spacing = spacings(KdTree(on.points));
  return on;
}

void PointSurface::bulge(Surface& s) const {
  s.bulge.clear();
  if (!smooth_) return;
  s.bulge.assign(s.faces.size(), {0, 0, 0});
  auto in_model = [&](const Vec3& p) -> Vec3 { return s.origin + s.scale * p; };
  tbb::parallel_for(tbb::blocked_range<size_t>(0, s.faces.size(), 256), [&](const auto& range) {
    for (size_t f = range.begin(); f < range.end(); f++)
      for (size_t k = 0; k < 3; k++) {
        const int g = s.adjacent[f][k];
        if (g >= 0 && g < int(f)) continue;  // its other face does
        const Vec3 &a = s.vertices[size_t(s.faces[f][k])], &b = s.vertices[size_t(s.faces[f][(k + 1) % 3])];
        Vec3 n = s.normals[f];
        if (g >= 0) n += s.normals[size_t(g)];
        if (!(n.norm() > 0.1)) continue;
        n.normalize();
        const Vec3 middle = in_model((a + b) / 2);
        const MlsPoint p = mls_->intersect(middle, n, n);
        const double height = (p.position - middle).dot(n) / s.scale;
        // no more than a quarter circle over the edge: the rest would be another sheet
        if (!p.found || std::fabs(height) > 0.2 * (b - a).norm()) continue;
        s.bulge[f][k] = float(height);
        if (g < 0) continue;
        for (size_t j = 0; j < 3; j++)
          if (s.adjacent[size_t(g)][j] == int(f)) s.bulge[size_t(g)][j] = float(height);
      }
  });
}

TriangleMesh curved_mesh(const Surface& s) {
  TriangleMesh mesh;
  auto add = [&](const Vec3& v) {
    const Vec3 p = s.origin + s.scale * v;
    mesh.positions.push_back({float(p.x()), float(p.y()), float(p.z())});
    return uint32_t(mesh.positions.size() - 1);
  };
  for (const Vec3& v : s.vertices) add(v);
  std::vector<std::array<uint32_t, 3>> middle(s.faces.size());
  for (size_t f = 0; f < s.faces.size(); f++) {
    std::array<uint32_t, 3> v;
    for (size_t k = 0; k < 3; k++) {
      v[k] = uint32_t(s.faces[f][k]);
      const int g = s.adjacent[f][k];
      if (g >= 0 && g < int(f)) {
        for (size_t j = 0; j < 3; j++)
          if (s.adjacent[size_t(g)][j] == int(f)) middle[f][k] = middle[size_t(g)][j];
        continue;
      }
      const Vec3 n = g < 0 ? s.normals[f] : Vec3(s.normals[f] + s.normals[size_t(g)]);
      const Vec3 &a = s.vertices[v[k]], &b = s.vertices[size_t(s.faces[f][(k + 1) % 3])];
      middle[f][k] = add((a + b) / 2 + double(s.bulge[f][k]) * n / std::max(n.norm(), 1e-9));
    }
    const auto& m = middle[f];
    for (const auto& t : {std::array{v[0], m[0], m[2]}, {m[0], v[1], m[1]}, {m[2], m[1], v[2]}, m})
      mesh.triangles.push_back(t);
  }
  return mesh;
}

}  // namespace relief
