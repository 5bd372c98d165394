#include "partition/enclosing_cone.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace relief {
namespace {

constexpr double kRounding = 1e-12;    // of squared distances between unit vectors
constexpr double kLeastCenter = 1e-6;  // of the ball, beyond which it counts as away from the origin

struct Ball {
  Vec3 center = Vec3::Zero();
  double squared_radius = -1;  // holds nothing

  double excess(const Vec3& p) const { return (p - center).squaredNorm() - squared_radius; }
};

// Points on the boundary of a ball.
struct Boundary {
  Vec3 point[4];
  int count = 0;
};

// The smallest ball with these points on its boundary; false if they are not affinely independent.
bool ball_through(const Boundary& b, Ball& ball) {
  ball = {};
  if (b.count == 0) return true;
  const int n = b.count - 1;
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3> q(3, n);
  for (int i = 0; i < n; ++i) q.col(i) = b.point[i + 1] - b.point[0];
  Vec3 middle = Vec3::Zero();
  if (n > 0) {
    const auto gram = (q.transpose() * q).eval();
    const auto lu = gram.fullPivLu();
    if (!lu.isInvertible()) return false;
    middle = q * lu.solve(0.5 * gram.diagonal());
  }
  ball = {b.point[0] + middle, middle.squaredNorm()};
  return true;
}

// Welzl's move-to-front: the smallest ball around the first n points with these on its boundary.
Ball move_to_front(std::vector<Vec3>& points, size_t n, const Boundary& boundary, Ball ball) {
  if (boundary.count == 4) return ball;
  for (size_t i = 0; i < n; ++i) {
    if (ball.excess(points[i]) <= kRounding) continue;
    Boundary with = boundary;
    with.point[with.count++] = points[i];
    Ball larger;
    if (!ball_through(with, larger)) continue;  // on the boundary, but for rounding
    ball = move_to_front(points, i, with, larger);
    std::rotate(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(i),
                points.begin() + static_cast<std::ptrdiff_t>(i) + 1);
  }
  return ball;
}

// Gaertner, Fast and Robust Smallest Enclosing Balls (1999): adds the farthest point to the few that decide,
// while the ball grows.
Ball smallest_enclosing_ball(const std::vector<Vec3>& points) {
  std::vector<Vec3> deciding;
  Ball ball;
  while (true) {
    double most = kRounding;
    const Vec3* farthest = nullptr;
    for (const Vec3& p : points) {
      const double excess = ball.excess(p);
      if (excess <= most) continue;
      most = excess;
      farthest = &p;
    }
    if (!farthest) return ball;
    deciding.insert(deciding.begin(), *farthest);
    const Ball larger = move_to_front(deciding, deciding.size(), {}, {});
    if (larger.squared_radius <= ball.squared_radius) return ball;
    ball = larger;
  }
}

}  // namespace

// The ball's boundary meets the unit sphere in a circle around its centre, which is the rim of the cone.
EnclosingCone smallest_enclosing_cone(const std::vector<Vec3>& normals) {
  const Vec3 center = smallest_enclosing_ball(normals).center;
  if (!(center.norm() > kLeastCenter)) return {};
  EnclosingCone cone{center.normalized(), 1};
  for (const Vec3& n : normals) cone.cosine = std::min(cone.cosine, n.dot(cone.axis));
  return cone;
}

}  // namespace relief
