// The normal-cone condition (paper, 3.2): the normals of a patch stay within an aperture of its plane's
// normal.
#pragma once
#include <algorithm>
#include <vector>

#include "partition/patches.h"

namespace relief {

// What patches are made of: the faces of a surface, or cells of several faces each.
struct Cells {
  std::vector<Eigen::Vector3f> smooth;  // normal averaged over a few rings of faces, unit
  std::vector<Eigen::Vector3f> own;     // normal of the cell itself: the average over its area, at most unit
  std::vector<double> area;
  std::vector<int> first, neighbour;  // neighbours of cell i: neighbour[first[i]] .. neighbour[first[i+1]-1]
};

// What the condition is tested with. On scans single faces are tilted or folded by noise, so the test looks
// at normals averaged over a few rings of faces, and tolerates small folded areas.
struct NormalCone {
  Cells cells;
  double cosine = 0;       // of the aperture: the epsilon of 3.2
  double folded_area = 0;  // largest connected area that may be outside of the cone

  // True if the cell's normal is within the cone around n. A cell is outside only if its own normal is, too.
  bool inside(int cell, const Vec3& n, double epsilon) const {
    const Eigen::Vector3f m = n.cast<float>();
    return cells.smooth[cell].dot(m) >= epsilon || cells.own[cell].dot(m) >= epsilon;
  }
  bool inside(int cell, const Vec3& n) const { return inside(cell, n, cosine); }

  // The area outside of the cone that a patch of this area may have in one connected region.
  double tolerance(double patch_area) const { return std::min(folded_area, patch_area / 50); }
};

// The cone condition on the faces of a surface; the aperture in degrees.
NormalCone make_normal_cone(const Surface& surface, double aperture);

// The same condition on cells of up to `most` connected faces with nearly the same normal. `cell` receives
// the cell of each face.
NormalCone coarsen(const NormalCone& faces, int most, std::vector<int>& cell);

// A(S) of equation (3): the smallest cosine between n and a normal of these cells.
double aperture_cosine(const NormalCone& cone, const int* begin, const int* end, const Vec3& n);

// A connected region of a patch that is outside of its cone: its area, and the cell that is farthest out.
struct FoldedRegion {
  double area = 0;
  int worst = -1;
  std::vector<int> cells;
};
// The regions of patch p (given its cells) that are larger than the tolerance. `mark` has an entry a cell,
// and is only touched for the cells of p; `stamp` must be a value that none of these has.
std::vector<FoldedRegion> folded_regions(const NormalCone& cone, const std::vector<int>& label, int p,
                                         const int* begin, const int* end, const Vec3& n,
                                         std::vector<int>& mark, int stamp);

// Makes every folded region above the tolerance a patch of its own, until none is left. Returns how many were
// cut off.
int split_folded(const NormalCone& cone, const Surface& surface, Patches& patches);

}  // namespace relief
