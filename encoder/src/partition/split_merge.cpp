#include "partition/split_merge.h"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "partition/connected.h"
#include "partition/enclosing_cone.h"
#include "partition/merge.h"

namespace relief {
namespace {

bool within_cone(const Cells& cells, const std::vector<int>& faces, double epsilon) {
  std::vector<Vec3> normals;
  normals.reserve(faces.size());
  for (int f : faces)
    if (cells.smooth[f].squaredNorm() > 0.5f) normals.push_back(cells.smooth[f].cast<double>().normalized());
  return normals.size() < 2 || smallest_enclosing_cone(normals).cosine >= epsilon;
}

// Cuts a cluster across its longest principal axis, through its centroid. The faces of the far half come
// last; returns where they begin.
size_t cut_in_two(const Surface& surface, std::vector<int>& faces) {
  Vec3 centroid = Vec3::Zero();
  double area = 0;
  for (int f : faces) {
    centroid += surface.areas[f] * middle_of(surface, f);
    area += surface.areas[f];
  }
  centroid /= area > 0 ? area : 1;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (int f : faces) {
    const Vec3 d = middle_of(surface, f) - centroid;
    covariance += surface.areas[f] * d * d.transpose();
  }
  const Vec3 axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors().col(2);
  const auto far = std::stable_partition(
      faces.begin(), faces.end(), [&](int f) { return (middle_of(surface, f) - centroid).dot(axis) < 0; });
  const auto cut = static_cast<size_t>(far - faces.begin());
  return cut > 0 && cut < faces.size() ? cut : faces.size() / 2;
}

Patches split(const NormalCone& cone, const Surface& surface, double epsilon) {
  Patches patches;
  patches.label.assign(surface.faces.size(), -1);
  std::vector<int> open = surface.component;  // cluster of each face that is to be looked at
  for (int& c : open)
    if (!(surface.component_area[c] > 0)) c = -1;
  while (true) {
    std::vector<Piece> pieces = pieces_of(surface, open);
    if (pieces.empty()) break;
    std::vector<char> valid(pieces.size());
    tbb::parallel_for(size_t{0}, pieces.size(), [&](size_t i) {
      std::vector<int>& faces = pieces[i].faces;
      valid[i] = within_cone(cone.cells, faces, epsilon);
      const size_t cut = valid[i] ? 0 : cut_in_two(surface, faces);
      for (size_t j = 0; j < faces.size(); ++j)
        open[faces[j]] = valid[i] ? -1 : static_cast<int>(2 * i + (j >= cut));
    });
    for (size_t i = 0; i < pieces.size(); ++i) {
      if (!valid[i]) continue;
      for (int f : pieces[i].faces) patches.label[f] = static_cast<int>(patches.normal.size());
      patches.normal.push_back(cone.cells.smooth[pieces[i].faces[0]].cast<double>());
    }
  }
  refit(surface, patches);
  return patches;
}

}  // namespace

Patches split_merge(const NormalCone& cone, const Surface& surface, double alpha) {
  const double beta = std::acos(cone.cosine);
  Patches patches = split(cone, surface, std::cos(std::min(alpha * M_PI / 180, beta / 2)));
  merge_cheapest(cone, surface, patches);
  // Noise tilts single normals, and with them the averages of small clusters.
  if (split_folded(cone, surface, patches) > 0) connect_patches(cone, surface, patches, cone.cosine);
  return patches;
}

}  // namespace relief
