// The normal-cone condition (paper, 3.2): the normals of a patch stay within an aperture of its plane's
// normal.
#pragma once
#include <vector>

#include "partition/patches.h"

namespace relief {

// What the condition is tested with. On scans single faces are tilted or folded by noise, so the test looks
// at normals averaged over a few rings of faces, and tolerates small folded areas.
struct NormalCone {
  const Surface* surface = nullptr;
  std::vector<Eigen::Vector3f> normals;  // smoothed, unit, one a face
  double cosine = 0;                     // of the aperture: the epsilon of 3.2
  double folded_area = 0;                // largest connected area that may be outside of the cone

  // True if the face's normal is within the cone around n. A face is outside only if its own normal is, too.
  bool inside(int face, const Vec3& n, double epsilon) const {
    return normals[face].dot(n.cast<float>()) >= epsilon || surface->normals[face].dot(n) >= epsilon;
  }
  bool inside(int face, const Vec3& n) const { return inside(face, n, cosine); }

  // The area outside of the cone that a patch of this area may have in one connected region.
  double tolerance(double patch_area) const { return std::min(folded_area, patch_area / 50); }
};

// Aperture in degrees.
NormalCone make_normal_cone(const Surface& surface, double aperture);

// A(S) of equation (3): the smallest cosine between n and a (smoothed) normal of these faces.
double aperture_cosine(const NormalCone& cone, const int* begin, const int* end, const Vec3& n);

// A connected region of a patch that is outside of its cone: its area, and the face that is farthest out.
struct FoldedRegion {
  double area = 0;
  int worst = -1;
  std::vector<int> faces;
};
// The regions of patch p (given its faces) that are larger than the tolerance. `mark` has an entry a face,
// and is only touched for the faces of p; `stamp` must be a value that none of these has.
std::vector<FoldedRegion> folded_regions(const NormalCone& cone, const std::vector<int>& label, int p,
                                         const int* begin, const int* end, const Vec3& n,
                                         std::vector<int>& mark, int stamp);

// Makes every folded region above the tolerance a patch of its own, until none is left. Returns how many were
// cut off.
int split_folded(const NormalCone& cone, Patches& patches);

}  // namespace relief
