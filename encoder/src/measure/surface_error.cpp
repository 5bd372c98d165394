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
    constexpr size_t kLarge = 4 << 20;  // triangles, whose hierarchy takes little memory at some cost in time
    rtcSetSceneFlags(scene_, triangles_.size() > kLarge ? RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT
                                                        : RTC_SCENE_FLAG_ROBUST);
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
    areas_.resize(triangles_.size());
    tbb::parallel_for(size_t(0), areas_.size(),
                      [&](size_t t) { areas_[t] = normal(uint32_t(t)).norm() / 2; });
  }
  SearchMesh(const SearchMesh&) = delete;
  SearchMesh& operator=(const SearchMesh&) = delete;
  ~SearchMesh() { rtcReleaseScene(scene_); }

  const std::vector<Eigen::Vector3d>& positions() const { return positions_; }
  const std::vector<std::array<uint32_t, 3>>& triangles() const { return triangles_; }
  const std::vector<double>& areas() const { return areas_; }

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
  std::vector<double> areas_;  // of triangles
  RTCScene scene_;
};

// From samples of one surface to the other, by the area that each sample stands for.
struct OneSided {
  double rms = 0, max = 0;  // of distances
  double deviation = 0;     // of rms: standard, over rms
  struct Angle {
    float degrees;  // negative where a triangle has no normal
    double area;
  };
  std::vector<Angle> angles;  // of each sample
};

float angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  if (a.squaredNorm() == 0 || b.squaredNorm() == 0) return -1;
  return float(std::atan2(a.cross(b).norm(), a.dot(b)) * (180 / 3.14159265358979323846));
}

// found: called with the number and the result of each point's search, from many threads.
template <class Found>
void search_all(const std::vector<Eigen::Vector3d>& points, const SearchMesh& to, Found found) {
  const size_t blocks = (points.size() + kBlock - 1) / kBlock;
  tbb::parallel_for(size_t(0), blocks, [&](size_t b) {
    uint32_t guess = std::numeric_limits<uint32_t>::max();
    for (size_t i = b * kBlock; i < std::min(points.size(), (b + 1) * kBlock); i++) {
      const Query query = to.closest(points[i], guess);  // points follow each other over the surface
      guess = query.triangle;
      found(i, query);
    }
  });
}

std::vector<double> squared_distances(const std::vector<Eigen::Vector3d>& points, const SearchMesh& to) {
  std::vector<double> squares(points.size());
  search_all(points, to, [&](size_t i, const Query& query) { squares[i] = query.best; });
  return squares;
}

// Squared distances of the middles of triangles, of a very large mesh: every so many in the order of the
// list, which runs over the surface, for those that follow.
std::vector<double> coarse_pilot(const SearchMesh& from, const SearchMesh& to, size_t stride) {
  const auto& positions = from.positions();
  std::vector<Eigen::Vector3d> points;
  for (size_t t = 0; t < from.triangles().size(); t += stride) {
    const auto& [a, b, c] = from.triangles()[t];
    points.push_back((positions[a] + positions[b] + positions[c]) / 3);
  }
  const std::vector<double> squares = squared_distances(points, to);
  std::vector<double> result;
  for (size_t t = 0; t < from.triangles().size(); t++) result.push_back(squares[t / stride]);
  return result;
}

// Squared distances of a mesh's positions, kept to save the time for those of the next mesh that are much the
// same: nearer than half of what these are away from the surface, rms.
struct KnownPositions {
  std::vector<Eigen::Vector3d> points;
  std::vector<double> squares;

  double much_the_same() const {
    double sum = 0;
    for (double square : squares) sum += square;
    return squares.empty() ? 0 : std::sqrt(sum / double(squares.size())) / 2;
  }
};

// Finds positions among known ones in much the same order: some were inserted or left out.
class PositionFollower {
 public:
  explicit PositionFollower(const KnownPositions& known)
      : known_(known), square_(known.much_the_same() * known.much_the_same()) {}

  // The number of one that is much the same as point i, or SIZE_MAX.
  size_t find(size_t i, const Eigen::Vector3d& point) {
    constexpr ptrdiff_t kAside = 32;
    constexpr int kPatience = 64;  // points in a row that are not found, after which none is looked for aside
    const ptrdiff_t here = ptrdiff_t(i) + shift_;
    if (is_like(here, point)) return misses_ = 0, size_t(here);
    if (misses_++ < kPatience)
      for (ptrdiff_t aside = 1; aside <= kAside; aside++)
        for (ptrdiff_t at : {here + aside, here - aside})
          if (is_like(at, point)) return misses_ = 0, shift_ = at - ptrdiff_t(i), size_t(at);
    return SIZE_MAX;
  }

 private:
  bool is_like(ptrdiff_t at, const Eigen::Vector3d& point) const {
    return at >= 0 && at < ptrdiff_t(known_.points.size()) &&
           (point - known_.points[size_t(at)]).squaredNorm() < square_;
  }

  const KnownPositions& known_;
  const double square_;
  ptrdiff_t shift_ = 0;
  int misses_ = 0;
};

void bring_up_to_date(KnownPositions& known, const SearchMesh& from, const SearchMesh& to) {
  const std::vector<Eigen::Vector3d>& points = from.positions();
  KnownPositions now = {points, std::vector<double>(points.size())};
  std::vector<size_t> others;
  std::vector<Eigen::Vector3d> moved;
  PositionFollower follower(known);
  for (size_t i = 0; i < points.size(); i++) {
    if (const size_t at = follower.find(i, points[i]); at != SIZE_MAX)
      now.points[i] = known.points[at], now.squares[i] = known.squares[at];
    else
      others.push_back(i), moved.push_back(points[i]);
  }
  const std::vector<double> squares = squared_distances(moved, to);
  for (size_t k = 0; k < others.size(); k++) now.squares[others[k]] = squares[k];
  known = std::move(now);
}

// Squared distances of a triangle's corners, and of the middles of those that are large: faces across what is
// open have their corners on the surface.
std::vector<double> pilot(const SearchMesh& from, const SearchMesh& to, const std::vector<double>& corners) {
  constexpr double kLarge = 2;  // times the mean area
  const std::vector<Eigen::Vector3d>& points = from.positions();
  std::vector<Eigen::Vector3d> middles;
  double mean = 0;
  for (double area : from.areas()) mean += area / double(from.areas().size());
  std::vector<uint32_t> large;
  for (uint32_t t = 0; t < from.triangles().size(); t++)
    if (from.areas()[t] > kLarge * mean) {
      const auto& [a, b, c] = from.triangles()[t];
      middles.push_back((points[a] + points[b] + points[c]) / 3);
      large.push_back(t);
    }
  const std::vector<double> squares = squared_distances(middles, to);
  std::vector<double> result;
  for (const auto& [a, b, c] : from.triangles()) result.push_back((corners[a] + corners[b] + corners[c]) / 3);
  for (size_t i = 0; i < large.size(); i++) result[large[i]] = 0.5 * (result[large[i]] + squares[i]);
  return result;
}

// Few triangles carry much of the error: half of the samples go where a look at triangles' corners finds it
// (importance sampling with a defensive mixture, Hesterberg 1995), so that the same number errs several times
// less. known: is used and brought up to date, but for very large meshes.
std::vector<double> importance(const SearchMesh& from, const SearchMesh& to, KnownPositions& known) {
  constexpr size_t kMostLooks = 1 << 21;
  const size_t stride = (from.triangles().size() + kMostLooks - 1) / kMostLooks;
  std::vector<double> weight;
  if (stride > 1) {
    weight = coarse_pilot(from, to, stride);
  } else {
    bring_up_to_date(known, from, to);
    weight = pilot(from, to, known.squares);
  }
  double sum = 0, area = 0;
  for (uint32_t t = 0; t < weight.size(); t++) {
    sum += from.areas()[t] * weight[t];
    area += from.areas()[t];
  }
  for (double& w : weight) w = sum > 0 ? 1 + w * area / sum : 1;
  return weight;
}

// Samples of one surface, more where it is far from the other. set: as in sample_surface
std::vector<SurfaceSample> samples_for(const SearchMesh& from, const SearchMesh& to, size_t count,
                                       KnownPositions& known, uint64_t set = 0) {
  return sample_surface(from.positions(), from.triangles(), count, importance(from, to, known), set);
}

std::vector<SurfaceSample> samples_for(const SearchMesh& from, const SearchMesh& to, size_t count) {
  KnownPositions nothing;
  return samples_for(from, to, count, nothing);
}

// Of rms over rms. squares: sum of what `count` samples add to rms^2; fourth: of the squares of that.
double deviation_of(double squares, double fourth, size_t count) {
  if (!(squares > 0)) return 0;
  return 0.5 * std::sqrt(std::max(0.0, fourth / (squares * squares) - 1 / double(count)));
}

double deviation_of(const std::vector<MutualSamples::Sample>& samples) {
  double squares = 0, fourth = 0;
  for (const auto& s : samples) squares += s.area * s.square, fourth += s.area * s.square * s.area * s.square;
  return deviation_of(squares, fourth, samples.size());
}

// Equation 1: from samples of `from`, every so many of them, to the surface `to`. angles: also those between
// normals.
OneSided measure_one_sided(const std::vector<SurfaceSample>& samples, size_t stride, const SearchMesh& from,
                           const SearchMesh& to, bool angles) {
  struct Sums {
    double area = 0, squares = 0, fourth = 0, max = 0;
  };
  OneSided result;
  const size_t count = (samples.size() + stride - 1) / stride;
  if (angles) result.angles.resize(count);
  const size_t blocks = (count + kBlock - 1) / kBlock;
  std::vector<Sums> sums(blocks);
  tbb::parallel_for(size_t(0), blocks, [&](size_t b) {
    uint32_t guess = std::numeric_limits<uint32_t>::max();
    for (size_t i = b * kBlock; i < std::min(count, (b + 1) * kBlock); i++) {
      const SurfaceSample& s = samples[i * stride];
      const Query found = to.closest(s.point, guess);
      guess = found.triangle;  // samples follow each other over the surface
      const double square = s.area * found.best;
      sums[b].area += s.area;
      sums[b].squares += square;
      sums[b].fourth += square * square;
      sums[b].max = std::max(sums[b].max, found.best);
      if (angles)
        result.angles[i] = {angle_between(from.normal(s.triangle), to.normal(found.triangle)), s.area};
    }
  });
  Sums all;
  for (const Sums& s : sums) {
    all.area += s.area, all.squares += s.squares, all.fourth += s.fourth;
    all.max = std::max(all.max, s.max);
  }
  result.rms = std::sqrt(all.squares / all.area);
  result.max = std::sqrt(all.max);
  result.deviation = deviation_of(all.squares, all.fourth, count);
  return result;
}

// own: a sample's triangle is that of `from`, else the closest one.
std::vector<MutualSamples::Sample> with_distances(const std::vector<SurfaceSample>& samples,
                                                  const SearchMesh& to, const Frame& frame, bool own) {
  std::vector<Eigen::Vector3d> points;
  for (const SurfaceSample& s : samples) points.push_back(s.point);
  std::vector<MutualSamples::Sample> result(samples.size());
  const double unit = frame.diagonal * frame.diagonal;
  search_all(points, to, [&](size_t i, const Query& query) {
    result[i] = {samples[i].point * frame.diagonal + frame.centre, own ? samples[i].triangle : query.triangle,
                 query.best * unit, samples[i].area * unit};
  });
  return result;
}

void summarise_angles(const OneSided& ab, const OneSided& ba, SurfaceError& error) {
  std::vector<OneSided::Angle> angles;
  double sum = 0, area = 0;
  for (const auto* list : {&ab.angles, &ba.angles})
    for (const OneSided::Angle& a : *list)
      if (a.degrees >= 0) angles.push_back(a), sum += a.degrees * a.area, area += a.area;
  if (angles.empty()) return;
  error.normal_mean = sum / area;
  std::sort(angles.begin(), angles.end(), [](const auto& a, const auto& b) { return a.degrees < b.degrees; });
  double below = 0;
  for (const OneSided::Angle& a : angles) {
    below += a.area;
    error.normal_p99 = a.degrees;
    if (below >= 0.99 * area) break;
  }
}

}  // namespace

// Of the error by samples of the original that were chosen for another mesh: targets keep a larger margin.
constexpr double kMostDeviation = 0.0025;

struct ErrorMeter::Impl {
  void choose_samples(const SearchMesh& to) {
    KnownPositions nothing;
    weight = importance(*original, to, nothing);
    samples = set_of_samples(0);
    others.clear();
  }
  std::vector<SurfaceSample> set_of_samples(uint64_t set) const {
    return sample_surface(original->positions(), original->triangles(), sample_count, weight, set);
  }
  // Equation 1 with one in so many of the samples.
  OneSided from_original(const SearchMesh& to, size_t share);

  std::unique_ptr<RTCDeviceTy, void (*)(RTCDevice)> device{rtcNewDevice(nullptr), &rtcReleaseDevice};
  size_t sample_count;
  Frame frame;
  std::unique_ptr<SearchMesh> original;
  std::vector<double> weight;  // of the original's triangles, for meshes like the last one
  // Of the original. What is chosen by samples is not measured by the same ones, which it suits too well.
  std::vector<SurfaceSample> samples, others;
  KnownPositions known;  // of the last one
};

ErrorMeter::ErrorMeter(const TriangleMesh& original, size_t samples) : impl_(std::make_unique<Impl>()) {
  if (!impl_->device) throw std::runtime_error("Embree could not be started");
  impl_->sample_count = std::max<size_t>(samples, 1);
  impl_->frame = frame_of(original);
  impl_->original =
      std::make_unique<SearchMesh>(impl_->device.get(), to_unit(original, impl_->frame), original.triangles);
  sample_surface(impl_->original->positions(), original.triangles, 1);  // throws if there is no area
}

ErrorMeter::~ErrorMeter() = default;

SurfaceError ErrorMeter::measure(const TriangleMesh& other) const {
  const SearchMesh& a = *impl_->original;
  const SearchMesh b(impl_->device.get(), to_unit(other, impl_->frame), other.triangles);
  const OneSided ab = measure_one_sided(samples_for(a, b, impl_->sample_count), 1, a, b, true);
  const OneSided ba = measure_one_sided(samples_for(b, a, impl_->sample_count), 1, b, a, true);
  const double diagonal = impl_->frame.diagonal;
  SurfaceError error;
  error.diagonal = diagonal;
  error.rms_ab = ab.rms * diagonal;
  error.rms_ba = ba.rms * diagonal;
  error.max_ab = ab.max * diagonal;
  error.max_ba = ba.max * diagonal;
  error.rms = std::max(error.rms_ab, error.rms_ba);  // equation 2
  error.max = std::max(error.max_ab, error.max_ba);
  error.rms_deviation = (ab.rms >= ba.rms ? ab : ba).deviation * error.rms;
  error.psnr = 20 * std::log10(diagonal / error.rms);
  summarise_angles(ab, ba, error);
  return error;
}

// Where samples of the original go is decided with the first mesh, and anew where they err too much.
OneSided ErrorMeter::Impl::from_original(const SearchMesh& to, size_t share) {
  const double most_deviation = kMostDeviation * std::sqrt(double(share));
  const bool earlier = !samples.empty();
  if (!earlier) choose_samples(to);
  OneSided result = measure_one_sided(samples, share, *original, to, false);
  if (!earlier || result.deviation <= most_deviation) return result;
  choose_samples(to);
  return measure_one_sided(samples, share, *original, to, false);
}

double ErrorMeter::relative_rms_from_original(const TriangleMesh& other, size_t share) {
  return impl_->from_original({impl_->device.get(), to_unit(other, impl_->frame), other.triangles}, share)
      .rms;
}

double ErrorMeter::relative_rms(const TriangleMesh& other) {
  constexpr size_t kFewer = 8;  // times fewer samples tell which way has the larger error
  constexpr double kSure = 6;   // deviations
  const SearchMesh& a = *impl_->original;
  const SearchMesh b(impl_->device.get(), to_unit(other, impl_->frame), other.triangles);
  const std::vector<SurfaceSample> samples = samples_for(b, a, impl_->sample_count, impl_->known);
  OneSided ab = impl_->from_original(b, kFewer);
  OneSided ba = measure_one_sided(samples, kFewer, b, a, false);
  const double unsure = kSure * (ab.rms * ab.deviation + ba.rms * ba.deviation);
  if (ba.rms > ab.rms - unsure) ba = measure_one_sided(samples, 1, b, a, false);
  if (ab.rms > ba.rms - unsure) ab = impl_->from_original(b, 1);
  return std::max(ab.rms, ba.rms);
}

MutualSamples ErrorMeter::samples(const TriangleMesh& other) {
  const SearchMesh& a = *impl_->original;
  const SearchMesh b(impl_->device.get(), to_unit(other, impl_->frame), other.triangles);
  auto original_samples = [&] {
    if (impl_->others.empty()) impl_->others = impl_->set_of_samples(1);
    return with_distances(impl_->others, b, impl_->frame, false);
  };
  const bool earlier = !impl_->weight.empty();
  if (!earlier) impl_->choose_samples(b);
  MutualSamples result = {original_samples(), {}};
  if (earlier && deviation_of(result.of_original) > kMostDeviation) {
    impl_->choose_samples(b);
    result.of_original = original_samples();
  }
  const std::vector<SurfaceSample> of_other = samples_for(b, a, impl_->sample_count, impl_->known, 1);
  result.of_other = with_distances(of_other, a, impl_->frame, true);
  return result;
}

std::vector<float> ErrorMeter::distance_of_positions(const TriangleMesh& other) const {
  std::vector<float> distances;
  for (double d : squared_distances(to_unit(other, impl_->frame), *impl_->original))
    distances.push_back(float(std::sqrt(d) * impl_->frame.diagonal));
  return distances;
}

std::vector<uint32_t> ErrorMeter::closest_triangles(
    const std::vector<std::array<float, 3>>& positions) const {
  std::vector<uint32_t> triangles(positions.size());
  search_all(to_unit({positions, {}, {}, {}}, impl_->frame), *impl_->original,
             [&](size_t i, const Query& query) { triangles[i] = query.triangle; });
  return triangles;
}

}  // namespace relief
