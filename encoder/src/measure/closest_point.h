// The distance from a point to a triangle.
#pragma once
#include <Eigen/Core>
#include <algorithm>

namespace relief {

// Squared. By the Voronoi region of the triangle's feature that the point lies in: Ericson, Real-Time
// Collision Detection, 2005, 5.1.5. Triangles without area give the distance to their longest edge or to a
// point of it.
inline double squared_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                               const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return ap.squaredNorm();
  const Eigen::Vector3d bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return bp.squaredNorm();
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return (ap - ab * (d1 > d3 ? d1 / (d1 - d3) : 0)).squaredNorm();
  const Eigen::Vector3d cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return cp.squaredNorm();
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return (ap - ac * (d2 > d6 ? d2 / (d2 - d6) : 0)).squaredNorm();
  const double va = d3 * d6 - d5 * d4, e4 = d4 - d3, e5 = d5 - d6;
  if (va <= 0 && e4 >= 0 && e5 >= 0) return (bp - (c - b) * (e4 + e5 > 0 ? e4 / (e4 + e5) : 0)).squaredNorm();
  const double sum = va + vb + vc;
  if (!(sum > 0)) return std::min({ap.squaredNorm(), bp.squaredNorm(), cp.squaredNorm()});
  return (ap - ab * (vb / sum) - ac * (vc / sum)).squaredNorm();
}

}  // namespace relief
