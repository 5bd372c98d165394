// Equations 1 and 2 of the paper (3.1) by sampling: for points spread over one surface, the distance to the
// other is found exactly with Embree's point queries.
#include "measure/surface_error.h"

#include <embree3/rtcore.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "measure/closest_point.h"
#include "measure/sampling.h"

namespace relief {
namespace {

// Work is cut into blocks of this many queries, whatever the number of threads; sums are made by block, then
// in the blocks' order, so that the result is the same bit for bit.
constexpr size_t kBlock = 2048;

// Moves the original's box to the origin with a diagonal of 1: Embree computes in float.
struct Frame {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double diagonal = 1;
  Eigen::Vector3d to_unit(const std::array<float, 3>& p) const {
    return (Eigen::Vector3d(p[0], p[1], p[2]) - centre) / diagonal;
  }
};

Frame frame_of(const TriangleMesh& mesh) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::max()), high = -low;
  for (const auto& p : mesh.positions) {
    low = low.cwiseMin(Eigen::Vector3d(p[0], p[1], p[2]));
    high = high.cwiseMax(Eigen::Vector3d(p[0], p[1], p[2]));
  }
  double diagonal = (high - low).norm();
  if (!(diagonal > 0)) throw InputError("has no triangle of positive area");
  return {(low + high) / 2, diagonal};
}

std::vector<Eigen::Vector3d> to_unit(const TriangleMesh& mesh, const Frame& frame) {
  std::vector<Eigen::Vector3d> positions(mesh.positions.size());
  for (size_t i = 0; i < positions.size(); i++) positions[i] = frame.to_unit(mesh.positions[i]);
  return positions;
}

// One search for the closest point: the best so far.
struct Query {
  const std::vector<Eigen::Vector3d>* positions;
  const std::vector<std::array<uint32_t, 3>>* triangles;
  Eigen::Vector3d point;
  double margin;  // covers what float loses of the point and the triangles
  double best = std::numeric_limits<double>::infinity();  // squared distance
  uint32_t triangle = std::numeric_limits<uint32_t>::max();

  // Ties go to the lower index, so that the answer does not depend on the order of the search.
  bool consider(uint32_t index) {
    const auto& t = (*triangles)[index];
    double d = squared_distance(point, (*positions)[t[0]], (*positions)[t[1]], (*positions)[t[2]]);
    if (d > best || (d == best && index >= triangle)) return false;
    best = d;
    triangle = index;
    return true;
  }
  float radius() const { return float(std::sqrt(best) * (1 + 1e-6) + margin); }
};

// A mesh in the unit frame with Embree's hierarchy over its triangles.
class SearchMesh {
 public:
  SearchMesh(RTCDevice device, std::vector<Eigen::Vector3d> positions,
             std::vector<std::array<uint32_t, 3>> triangles)
      : positions_(std::move(positions)), triangles_(std::move(triangles)), scene_(rtcNewScene(device)) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                                 RTC_FORMAT_FLOAT3, 12, positions_.size()));
    for (size_t i = 0; i < positions_.size(); i++)
      for (int k = 0; k < 3; k++) vertices[3 * i + k] = float(positions_[i][k]);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, triangles_.data(), 0, 12,
                               triangles_.size());
    rtcSetGeometryPointQueryFunction(geometry, &visit);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
    RTCError error = rtcGetDeviceError(device);
    if (error != RTC_ERROR_NONE) throw std::runtime_error("Embree error " + std::to_string(int(error)));
  }
  SearchMesh(const SearchMesh&) = delete;
  SearchMesh& operator=(const SearchMesh&) = delete;
  ~SearchMesh() { rtcReleaseScene(scene_); }

  const std::vector<Eigen::Vector3d>& positions() const { return positions_; }
  const std::vector<std::array<uint32_t, 3>>& triangles() const { return triangles_; }

  // The closest triangle to a point. `guess` is a triangle that may be near; it only saves time.
  Query closest(const Eigen::Vector3d& point, uint32_t guess) const {
    Query query{&positions_, &triangles_, point, 4e-7 * std::max(1.0, point.cwiseAbs().maxCoeff())};
    if (guess < triangles_.size()) query.consider(guess);
    RTCPointQuery ball{};
    ball.x = float(point[0]), ball.y = float(point[1]), ball.z = float(point[2]);
    ball.radius = query.radius();
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene_, &ball, &context, nullptr, &query);
    return query;
  }

  Eigen::Vector3d normal(uint32_t triangle) const {  // not of unit length
    const auto& t = triangles_[triangle];
    return (positions_[t[1]] - positions_[t[0]]).cross(positions_[t[2]] - positions_[t[0]]);
  }

 private:
  static bool visit(RTCPointQueryFunctionArguments* arguments) {
    auto* query = static_cast<Query*>(arguments->userPtr);
    if (!query->consider(arguments->primID)) return false;
    arguments->query->radius = query->radius();
    return true;
  }

  std::vector<Eigen::Vector3d> positions_;
  std::vector<std::array<uint32_t, 3>> triangles_;
  RTCScene scene_;
};

struct OneSided {
  double sum = 0, max = 0;    // of squared distances
  std::vector<float> angles;  // of each sample, degrees; negative where a triangle has no normal
};

float angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  if (a.squaredNorm() == 0 || b.squaredNorm() == 0) return -1;
  return float(std::atan2(a.cross(b).norm(), a.dot(b)) * (180 / 3.14159265358979323846));
}

// Equation 1: from samples of `from` to the surface `to`. angles: also those between normals.
OneSided measure_one_sided(const std::vector<SurfaceSample>& samples, const SearchMesh& from,
                           const SearchMesh& to, bool angles) {
  OneSided result;
  if (angles) result.angles.resize(samples.size());
  size_t blocks = (samples.size() + kBlock - 1) / kBlock;
  std::vector<double> sums(blocks, 0), maxima(blocks, 0);
  tbb::parallel_for(size_t(0), blocks, [&](size_t b) {
    uint32_t guess = std::numeric_limits<uint32_t>::max();
    for (size_t i = b * kBlock; i < std::min(samples.size(), (b + 1) * kBlock); i++) {
      Query found = to.closest(samples[i].point, guess);
      guess = found.triangle;  // samples follow each other over the surface
      sums[b] += found.best;
      maxima[b] = std::max(maxima[b], found.best);
      if (angles)
        result.angles[i] = angle_between(from.normal(samples[i].triangle), to.normal(found.triangle));
    }
  });
  for (size_t b = 0; b < blocks; b++) {
    result.sum += sums[b];
    result.max = std::max(result.max, maxima[b]);
  }
  return result;
}

void summarise_angles(const OneSided& ab, const OneSided& ba, SurfaceError& error) {
  std::vector<float> angles;
  for (const auto* list : {&ab.angles, &ba.angles})
    for (float a : *list)
      if (a >= 0) angles.push_back(a);
  if (angles.empty()) return;
  double sum = 0;
  for (float a : angles) sum += a;
  error.normal_mean = sum / double(angles.size());
  auto p99 = angles.begin() + std::ptrdiff_t((angles.size() - 1) * 99 / 100);
  std::nth_element(angles.begin(), p99, angles.end());
  error.normal_p99 = *p99;
}

}  // namespace

struct ErrorMeter::Impl {
  std::unique_ptr<RTCDeviceTy, void (*)(RTCDevice)> device{rtcNewDevice(nullptr), &rtcReleaseDevice};
  size_t sample_count;
  Frame frame;
  std::unique_ptr<SearchMesh> original;
  std::vector<SurfaceSample> samples;
};

ErrorMeter::ErrorMeter(const TriangleMesh& original, size_t samples) : impl_(std::make_unique<Impl>()) {
  if (!impl_->device) throw std::runtime_error("Embree could not be started");
  impl_->sample_count = std::max<size_t>(samples, 1);
  impl_->frame = frame_of(original);
  impl_->original =
      std::make_unique<SearchMesh>(impl_->device.get(), to_unit(original, impl_->frame), original.triangles);
  impl_->samples = sample_surface(impl_->original->positions(), original.triangles, impl_->sample_count);
}

ErrorMeter::~ErrorMeter() = default;

SurfaceError ErrorMeter::measure(const TriangleMesh& other) const {
  SearchMesh b(impl_->device.get(), to_unit(other, impl_->frame), other.triangles);
  std::vector<SurfaceSample> samples = sample_surface(b.positions(), other.triangles, impl_->sample_count);
  OneSided ab = measure_one_sided(impl_->samples, *impl_->original, b, true);
  OneSided ba = measure_one_sided(samples, b, *impl_->original, true);
  double diagonal = impl_->frame.diagonal;
  SurfaceError error;
  error.diagonal = diagonal;
  error.rms_ab = std::sqrt(ab.sum / double(impl_->samples.size())) * diagonal;
  error.rms_ba = std::sqrt(ba.sum / double(samples.size())) * diagonal;
  error.max_ab = std::sqrt(ab.max) * diagonal;
  error.max_ba = std::sqrt(ba.max) * diagonal;
  error.rms = std::max(error.rms_ab, error.rms_ba);  // equation 2
  error.max = std::max(error.max_ab, error.max_ba);
  error.psnr = 20 * std::log10(diagonal / error.rms);
  summarise_angles(ab, ba, error);
  return error;
}

double ErrorMeter::relative_rms(const TriangleMesh& other, size_t count) const {
  const SearchMesh& a = *impl_->original;
  const SearchMesh b(impl_->device.get(), to_unit(other, impl_->frame), other.triangles);
  const OneSided ab = measure_one_sided(sample_surface(a.positions(), a.triangles(), count), a, b, false);
  const OneSided ba = measure_one_sided(sample_surface(b.positions(), b.triangles(), count), b, a, false);
  return std::sqrt(std::max(ab.sum, ba.sum) / double(count));
}

std::vector<float> ErrorMeter::distance_of_positions(const TriangleMesh& other) const {
  std::vector<float> distances(other.positions.size());
  size_t blocks = (distances.size() + kBlock - 1) / kBlock;
  tbb::parallel_for(size_t(0), blocks, [&](size_t b) {
    uint32_t guess = std::numeric_limits<uint32_t>::max();
    for (size_t i = b * kBlock; i < std::min(distances.size(), (b + 1) * kBlock); i++) {
      Query found = impl_->original->closest(impl_->frame.to_unit(other.positions[i]), guess);
      guess = found.triangle;
      distances[i] = float(std::sqrt(found.best) * impl_->frame.diagonal);
    }
  });
  return distances;
}

}  // namespace relief
