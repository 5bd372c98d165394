#include "points/point_error.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "measure/surface_error.h"
#include "points/point_surface.h"

namespace relief {
namespace {

Vec3 vec(const std::array<float, 3>& p) { return {p[0], p[1], p[2]}; }

double diagonal_of(const TriangleMesh& mesh) {
  Vec3 low = Vec3::Constant(INFINITY), high = -low;
  for (const auto& p : mesh.positions) low = low.cwiseMin(vec(p)), high = high.cwiseMax(vec(p));
  const double diagonal = (high - low).norm();
  if (!(diagonal > 0)) throw InputError("has no extent");
  return diagonal;
}

std::vector<float> to_mesh(const TriangleMesh& points, const TriangleMesh& mesh) {
  constexpr size_t kFewSamples = 1000;  // only the search structure is needed
  return ErrorMeter(mesh, kFewSamples).distance_of_positions(points);
}

// d(p, S) = |p - Psi(p)|. The side is that of the nearest point; where too few points are near for a
// projection, its distance.
std::vector<float> to_points(const TriangleMesh& points, const PointSurface& surface) {
  std::vector<float> distance(points.positions.size());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, distance.size(), 64), [&](const auto& range) {
    std::vector<Neighbour> near;
    for (size_t i = range.begin(); i < range.end(); i++) {
      const Vec3 p = vec(points.positions[i]);
      surface.tree().nearest(p, 1, near);
      const MlsPoint on = surface.project(p, surface.cloud().normals[near[0].index]);
      distance[i] = float(on.found ? (on.position - p).norm() : std::sqrt(near[0].squared));
    }
  });
  return distance;
}

void summarise(const std::vector<float>& distance, double& rms, double& max) {
  double sum = 0;
  for (float d : distance) sum += double(d) * d, max = std::max(max, double(d));
  rms = std::sqrt(sum / double(std::max<size_t>(1, distance.size())));
}

}  // namespace

PointError point_error(const TriangleMesh& a, const TriangleMesh& b) {
  PointError e;
  e.diagonal = diagonal_of(a);
  if (!b.triangles.empty()) {
    summarise(to_mesh(a, b), e.rms_ab, e.max_ab);
  } else if (!a.triangles.empty()) {
    summarise(to_mesh(b, a), e.rms_ba, e.max_ba);
  } else {
    summarise(to_points(a, PointSurface(b)), e.rms_ab, e.max_ab);
    summarise(to_points(b, PointSurface(a)), e.rms_ba, e.max_ba);
  }
  return e;
}

}  // namespace relief
