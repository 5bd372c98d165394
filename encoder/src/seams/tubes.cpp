#include "seams/tubes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "tube.h"

namespace relief {
namespace {

constexpr size_t kMostNear = 400;     // triangles that are tried as ends of a tube
constexpr size_t kMostTrials = 1000;  // pairs of them
// Of the smallest ball about a handle so many radii, and so many grid spacings at least, are looked around.
constexpr double kReach = 1.5, kLeastReach = 5;

using Tube = std::array<uint32_t, 2>;  // triangles, the lower first

// Triangles around a place, in lattice coordinates, with room for one tube.
class Neighbourhood {
 public:
  Neighbourhood(const Ground& ground, const TriangleMesh& mesh, const std::vector<uint32_t>& triangles) {
    std::map<uint32_t, uint32_t> number;
    for (uint32_t t : triangles) {
      auto& corners = mesh_.triangles.emplace_back();
      for (size_t k = 0; k < 3; k++) {
        const uint32_t v = mesh.triangles[t][k];
        const auto [at, fresh] = number.insert({v, uint32_t(number.size())});
        if (fresh) {
          const Vec3 p = ground.lattice(mesh.positions[v]);
          mesh_.positions.push_back(
              {float(std::round(p[0])), float(std::round(p[1])), float(std::round(p[2]))});
        }
        corners[k] = at->second;
      }
      for (size_t k = 0; k < 3; k++)
        across_[{corners[(k + 1) % 3], corners[k]}] = uint32_t(mesh_.triangles.size() - 1);
    }
  }

  // How many pairs of neighbours that are folded onto one another a tube between two of the triangles makes,
  // or may make, where triangles beyond are not known: between patches.
  uint64_t folds(const Tube& tube) const {
    TriangleMesh mesh = {mesh_.positions, {}, {}, {}};
    for (uint32_t t : tube) mesh.triangles.push_back(mesh_.triangles[t]);
    const uint32_t vertices = uint32_t(mesh.positions.size());
    mesh.positions.resize(vertices + kTubeVertices);
    mesh.triangles.resize(2 + kTubeTriangles);
    MeshWriter writer = {mesh.positions[0].data(),
                         mesh.triangles[0].data(),
                         vertices + kTubeVertices,
                         2 + kTubeTriangles,
                         vertices,
                         2};
    add_tube(writer, 0, 1);
    uint64_t unknown = 0;
    for (uint32_t t : tube)
      for (size_t k = 0; k < 3; k++) {
        const auto& c = mesh_.triangles[t];
        const auto beyond = across_.find({c[k], c[(k + 1) % 3]});
        if (beyond != across_.end())
          mesh.triangles.push_back(mesh_.triangles[beyond->second]);
        else
          unknown++;
      }
    return topology(mesh).flipped + unknown;
  }

 private:
  TriangleMesh mesh_;
  std::map<std::array<uint32_t, 2>, uint32_t>
      across_;  // the triangle beyond an edge, by the edge's direction
};

class TubeFinder {
 public:
  TubeFinder(const SeamContext& in, const DecodedMesh& d) : in_(in), d_(d), taken_(d.patch_triangles(), 0) {
    join_across_gaps(d, in.part, in.parts, &component_);
    for (size_t t = 0; t < d.patch_triangles(); t++) {
      Vec3 sum = Vec3::Zero();
      for (uint32_t v : d.mesh.triangles[t]) sum += in.ground.lattice(d.mesh.positions[v]);
      middle_.push_back(sum / 3);
    }
  }

  // The shortest tube near a handle of those with the fewest folds, between triangles that no tube has.
  std::optional<Tube> find(const HandlePlace& handle) const {
    const std::vector<uint32_t> near = triangles_near(handle);
    const Neighbourhood around(in_.ground, d_.mesh, near);
    std::optional<Tube> best;
    uint64_t fewest = UINT64_MAX;
    for (const Tube& pair : pairs_of(near, handle)) {
      const uint64_t folds = around.folds(pair);
      if (folds >= fewest) continue;
      fewest = folds;
      best = {std::min(near[pair[0]], near[pair[1]]), std::max(near[pair[0]], near[pair[1]])};
      if (folds == 0) break;
    }
    return best;
  }

  void take(const Tube& tube) {
    for (uint32_t t : tube) taken_[t] = 1;
  }

 private:
  // The nearest first, of one component.
  std::vector<uint32_t> triangles_near(const HandlePlace& handle) const {
    const double reach = std::max(kReach * handle.radius, kLeastReach * double(in_.coded.placement.spacing));
    std::vector<std::pair<double, uint32_t>> found;
    for (uint32_t t = 0; t < middle_.size(); t++) {
      const double square = (middle_[t] - handle.middle).squaredNorm();
      if (square <= reach * reach) found.push_back({square, t});
    }
    std::sort(found.begin(), found.end());
    found.resize(std::min(found.size(), kMostNear));
    auto component = [&](uint32_t t) { return component_[d_.mesh.triangles[t][0]]; };
    std::vector<uint32_t> near;
    for (const auto& [square, t] : found)
      if (component(t) == component(found[0].second)) near.push_back(t);
    return near;
  }

  // Of these, by their places in `near`: short ones near the handle first.
  std::vector<Tube> pairs_of(const std::vector<uint32_t>& near, const HandlePlace& handle) const {
    std::vector<std::pair<double, Tube>> found;
    for (uint32_t i = 0; i < near.size(); i++)
      for (uint32_t k = 0; k < i; k++) {
        const Vec3 &p = middle_[near[i]], &q = middle_[near[k]];
        if (!taken_[near[i]] && !taken_[near[k]])
          found.push_back({(p - q).norm() + ((p + q) / 2 - handle.middle).norm(), {k, i}});
      }
    const size_t count = std::min(found.size(), kMostTrials);
    std::partial_sort(found.begin(), found.begin() + ptrdiff_t(count), found.end());
    std::vector<Tube> pairs;
    for (size_t i = 0; i < count; i++) pairs.push_back(found[i].second);
    return pairs;
  }

  const SeamContext& in_;
  const DecodedMesh& d_;
  std::vector<Vec3> middle_;    // of patches' triangles
  std::vector<int> component_;  // of what is decoded, of each pixel
  std::vector<char> taken_;     // of those triangles
};

}  // namespace

void add_tubes(const SeamContext& in, Attempt& best) {
  const int64_t missing = in.topology.genus - best.topology.genus;
  if (missing <= 0 || in.handles.empty() || best.topology.components != in.topology.components) return;
  TubeFinder finder(in, best.decoded);
  Seams seams = best.seams;
  const size_t most = std::min(size_t(missing), size_t(most_tubes(in.coded.boundary_nodes)));
  for (const HandlePlace& handle : in.handles) {
    if (seams.tubes.size() == most) break;
    const auto tube = finder.find(handle);
    if (!tube) continue;
    finder.take(*tube);
    seams.tubes.push_back(*tube);
  }
  std::sort(seams.tubes.begin(), seams.tubes.end());
  Attempt a = attempt(in, std::move(seams));
  a.topology = topology(a.decoded.mesh);  // attempt counts on the patches' own triangles
  if (a.topology.genus > best.topology.genus && a.topology.genus <= in.topology.genus) best = std::move(a);
}

}  // namespace relief
