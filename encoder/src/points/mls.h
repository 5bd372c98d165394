// The moving least squares surface of a point cloud (paper, section 3, after Alexa, Behr, Cohen-Or,
// Fleishman, Levin and Silva, "Computing and Rendering Point Set Surfaces", 2003 [ABCO*03]).
#pragma once
#include "points/cloud.h"

namespace relief {

struct MlsPoint {
  Vec3 position, normal;  // on the surface
  bool found = false;     // false: there are too few points around
};

class MlsSurface {
 public:
  // reach: how far each point is heard; its Gaussian weight has fallen to exp(-4) there. Keeps references.
  MlsSurface(const KdTree& tree, const std::vector<Vec3>& normals, const std::vector<double>& reach);

  // The projection operator Psi: from `start`, the plane of the points around, and over it the quadratic
  // polynomial that fits them best, by weighted least squares. `normal` says which side is meant where two
  // sheets are near: points whose normals disagree with it are not heard.
  MlsPoint project(const Vec3& start, const Vec3& normal) const;

  // How far point i lies from the surface of the others, and from a plane through them; INFINITY: there are
  // too few.
  std::pair<double, double> prediction(size_t i) const;

  // Where the line through `start` along `direction` meets the surface, by the Newton-like iteration of 3.4
  // and figure 7: project, intersect the tangent plane there with the line, repeat.
  MlsPoint intersect(const Vec3& start, const Vec3& direction, const Vec3& normal) const;

  // The rms distance of the points within reach of point i from the surface around it, as one would estimate
  // the noise: with the degrees of freedom that the polynomial takes.
  double residual(size_t i) const;

 private:
  struct Fit;
  bool fit(const Vec3& centre, double reach, const Vec3& normal, Fit& f, size_t without = SIZE_MAX) const;
  double reach_at(const Vec3& p) const;

  const KdTree& tree_;
  const std::vector<Vec3>& normals_;
  const std::vector<double>& reach_;
};

}  // namespace relief
