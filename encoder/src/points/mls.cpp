#include "points/mls.h"

#include <Eigen/Dense>
#include <cmath>

namespace relief {
namespace {

constexpr size_t kFewest = 6;   // points for a polynomial of six coefficients
constexpr double kAgree = 0.2;  // least cosine between normals that are heard together
constexpr int kProjections = 3, kIntersections = 4;
constexpr double kConverged = 1e-3;  // of the reach
constexpr double kRidge = 1e-6;      // keeps the polynomial flat where points say nothing

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

std::vector<Neighbour>& scratch() {
  thread_local std::vector<Neighbour> near;
  return near;
}

}  // namespace

// A polynomial z = c . (1, x, y, x^2, xy, y^2) over the plane through `origin`; lengths are divided by the
// reach.
struct MlsSurface::Fit {
  Vec3 origin, x, y, normal;
  double reach;
  Vector6 c;
  double residual;  // rms, weighted, with the degrees of freedom

  Vec3 position() const { return origin + normal * (reach * c[0]); }
  Vec3 normal_there() const { return (normal - c[1] * x - c[2] * y).normalized(); }
};

MlsSurface::MlsSurface(const KdTree& tree, const std::vector<Vec3>& normals, const std::vector<double>& reach)
    : tree_(tree), normals_(normals), reach_(reach) {}

double MlsSurface::reach_at(const Vec3& p) const {
  tree_.nearest(p, 3, scratch());
  double most = 0;
  for (const Neighbour& n : scratch()) most = std::max(most, reach_[n.index]);
  return most;
}

bool MlsSurface::fit(const Vec3& centre, double reach, const Vec3& normal, Fit& f, size_t without) const {
  auto& near = scratch();
  tree_.within(centre, reach, near);
  // the plane: its normal is the weighted mean of the points' own, its height that of the weighted mean point
  Vec3 mean = Vec3::Zero(), n = Vec3::Zero();
  double sum = 0;
  const double fall = 4 / (reach * reach);
  size_t heard = 0;
  for (Neighbour& m : near) {
    if (m.index == without || normals_[m.index].dot(normal) < kAgree) continue;
    const double w = std::exp(-fall * m.squared);
    mean += w * (tree_.points()[m.index] - centre), n += w * normals_[m.index], sum += w;
    near[heard++] = {m.index, w};
  }
  near.resize(heard);
  if (heard < kFewest || !(n.norm() > 0)) return false;
  f.normal = n.normalized();
  f.origin = centre + f.normal * (f.normal.dot(mean) / sum);
  f.x = f.normal.unitOrthogonal(), f.y = f.normal.cross(f.x);
  f.reach = reach;
  Matrix6 a = Matrix6::Zero();
  Vector6 b = Vector6::Zero();
  double zz = 0;
  for (const Neighbour& m : near) {
    const double w = m.squared / sum;
    const Vec3 d = (tree_.points()[m.index] - f.origin) / reach;
    const double x = d.dot(f.x), y = d.dot(f.y), z = d.dot(f.normal);
    const Vector6 v = (Vector6() << 1, x, y, x * x, x * y, y * y).finished();
    a.selfadjointView<Eigen::Lower>().rankUpdate(v, w);
    b += w * z * v, zz += w * z * z;
  }
  a.diagonal().array() += kRidge;
  f.c = a.selfadjointView<Eigen::Lower>().ldlt().solve(b);
  f.residual = reach * std::sqrt(std::max(0.0, zz - b.dot(f.c)) * double(heard) /
                                 std::max(1.0, double(heard) - double(kFewest)));
  return f.c.allFinite();
}

MlsPoint MlsSurface::project(const Vec3& start, const Vec3& normal) const {
  const double reach = reach_at(start);
  Vec3 p = start, n = normal;
  for (int i = 0; i < kProjections; i++) {
    Fit f;
    if (!fit(p, reach, n, f)) return {p, n, false};
    const double moved = (f.position() - p).norm();
    p = f.position(), n = f.normal_there();
    if (moved < kConverged * reach) break;
  }
  return {p, n, true};
}

std::pair<double, double> MlsSurface::prediction(size_t i) const {
  Fit f;
  const Vec3& p = tree_.points()[i];
  if (!fit(p, reach_[i], normals_[i], f, i)) return {INFINITY, INFINITY};
  return {(f.position() - p).norm(), (f.origin - p).norm()};
}

MlsPoint MlsSurface::intersect(const Vec3& start, const Vec3& direction, const Vec3& normal) const {
  constexpr double kGrazing = 0.02;
  const double reach = reach_at(start);
  Vec3 p = start, n = normal;
  for (int i = 0; i < kIntersections; i++) {
    Fit f;
    if (!fit(p, reach, n, f)) return {p, n, false};
    n = f.normal_there();
    const double facing = n.dot(direction);
    if (std::fabs(facing) < kGrazing) return {p, n, false};
    const double t = n.dot(f.position() - p) / facing;
    if (std::fabs(t) > 2 * reach) return {p, n, false};
    p += t * direction;
    if (std::fabs(t) < kConverged * reach) break;
  }
  return {p, n, true};
}

double MlsSurface::residual(size_t i) const {
  Fit f;
  return fit(tree_.points()[i], reach_[i], normals_[i], f) ? f.residual : 0;
}

}  // namespace relief
