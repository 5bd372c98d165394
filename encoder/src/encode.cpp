// The whole way from a mesh to a stream that meets its target.
#include "relief/encoder.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>

#include "allocate/allocate.h"
#include "holes.h"
#include "measure/surface_error.h"
#include "partition/partition.h"

namespace relief {
namespace {

constexpr size_t kErrorSamples = 300000;
constexpr int kDiffusionRounds = 24;
constexpr double kRingReach = 10;       // mean vertex spacings around a patch that its raster sees
constexpr double kCoarsest = 16;        // spacing of resolution 0, mean vertex spacings
constexpr double kHoleDistance = 1.0;   // grid spacings from the surface at which a face is a hole
constexpr int kMaxTrials = 12;

class Stopwatch {
 public:
  explicit Stopwatch(EncodeResult& result) : result_(result), last_(Clock::now()) {}
  void lap(const char* stage) {
    const auto now = Clock::now();
    const double s = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    for (auto& [name, seconds] : result_.seconds)
      if (name == stage) {
        seconds += s;
        return;
      }
    result_.seconds.push_back({stage, s});
  }

 private:
  using Clock = std::chrono::steady_clock;
  EncodeResult& result_;
  Clock::time_point last_;
};

// Everything that does not depend on the target's Lagrangian parameter.
struct Job {
  const TriangleMesh& mesh;
  const EncodeOptions& options;
  Surface surface;
  Partition partition;
  Ownership ownership;
  std::vector<PatchFaces> patches;
  std::unique_ptr<ErrorMeter> meter;
  double spacing = 0;  // mean spacing of the input's vertices
  bool closed = true;
  std::unique_ptr<Allocator> allocator;
};

// One stream and what it decodes to.
struct Trial {
  double lambda = 0;
  std::vector<uint8_t> stream;
  double error = 0;  // fraction of the diagonal
  std::vector<int> patch_number;
};

DistanceToSurface distance_to(const Job& m) {
  return [&m](const std::vector<Vec3>& points) {
    TriangleMesh query;
    query.positions.reserve(points.size());
    for (const Vec3& p : points) {
      const Vec3 q = m.surface.origin + m.surface.scale * p;
      query.positions.push_back({float(q.x()), float(q.y()), float(q.z())});
    }
    std::vector<float> d = m.meter->distance_of_positions(query);
    for (float& x : d) x = float(x / m.surface.scale);
    return d;
  };
}

void report(const EncodeOptions& o, const char* stage, double done) {
  if (o.progress) o.progress(stage, done);
}

void prepare(Job& m, Stopwatch& watch) {
  report(m.options, "surface", 0);
  m.surface = build_surface(m.mesh);
  for (const auto& a : m.surface.adjacent) m.closed = m.closed && a[0] >= 0 && a[1] >= 0 && a[2] >= 0;
  m.spacing = std::sqrt(m.surface.total_area / double(m.surface.vertices.size()));
  watch.lap("surface");
  m.meter = std::make_unique<ErrorMeter>(m.mesh, kErrorSamples);
  watch.lap("measure");
  report(m.options, "partition", 0.05);
  PartitionOptions p;
  p.aperture = m.options.aperture;
  p.progress = [&](double done) { report(m.options, "partition", 0.05 + 0.35 * done); };
  m.partition = partition_gla(m.surface, p);
  watch.lap("partition");
  report(m.options, "resample", 0.4);
  m.ownership = diffuse_labels(m.surface, m.partition, kDiffusionRounds);
  m.patches = gather_patches(m.surface, m.partition, kRingReach * m.spacing);
  m.allocator = std::make_unique<Allocator>(AllocationInput{m.surface, m.ownership, m.patches, distance_to(m),
                                                            kCoarsest * m.spacing, m.options.fit});
  watch.lap("resample");
}

Trial try_lambda(const Job& m, double lambda, Stopwatch& watch) {
  Trial trial;
  trial.lambda = lambda;
  const Allocator::Choice choice =
      m.options.density > 0 ? m.allocator->fixed(lambda, m.options.density) : m.allocator->choose(lambda);
  double spacing, step;
  const std::vector<CodedPatch> patches = m.allocator->coded(choice, spacing, step, trial.patch_number);
  watch.lap("allocate");
  if (patches.empty()) throw InputError("the surface is too small or too thin to be sampled");
  StreamPlacement placement = {{}, float(m.surface.scale), float(spacing), float(step), float(kTrade), m.closed};
  for (int k = 0; k < 3; k++) placement.origin[k] = float(m.surface.origin[k]);
  const StreamParts parts = code_stream(patches, placement);
  // counts are known after decoding, real holes likewise
  StreamCounts counts = {parts.boundary_nodes, 0, 0};
  trial.stream = assemble(parts, counts, {});
  watch.lap("code");
  DecodedMesh decoded = decode_with_faces(trial.stream);
  Seams seams;
  if (!m.closed) seams.holes = find_holes(decoded, m.surface, distance_to(m), kHoleDistance * spacing);
  if (!seams.holes.empty()) decoded = decode_with_faces(assemble(parts, counts, seams));
  counts.vertices = uint32_t(decoded.positions.size());
  counts.triangles = uint32_t(decoded.triangles.size());
  trial.stream = assemble(parts, counts, seams);
  watch.lap("decode");
  TriangleMesh result;
  result.positions = std::move(decoded.positions);
  result.triangles = std::move(decoded.triangles);
  const SurfaceError e = m.meter->measure(result);
  trial.error = e.rms / e.diagonal;
  watch.lap("measure");
  return trial;
}

// How a trial stands to the target: 0 on it, positive beyond it (error too large, too many bytes), in the logarithm.
double excess(const Trial& t, const EncodeOptions& o, double bytes) {
  return bytes > 0 ? std::log(double(t.stream.size()) / bytes) : std::log(t.error / o.error);
}

// Bisection on the Lagrangian parameter (3.6), in its logarithm, with the secant as the first guess. Ends with the best
// trial that keeps within the target, at most 1% (bytes) or 2% (error) inside.
Trial search(const Job& m, double bytes, bool& met, Stopwatch& watch) {
  const double tolerance = bytes > 0 ? 0.01 : 0.02;
  const double direction = bytes > 0 ? -1 : 1;  // excess rises with lambda for errors, falls for bytes
  double guess = m.options.error * kLatticeDiagonal * 4.5 * m.spacing;  // step * spacing for the error
  if (bytes > 0) guess = 1e-4 * kLatticeDiagonal * 4.5 * m.spacing;
  double x = std::log(kTrade * guess * guess);
  double slope = direction * (bytes > 0 ? 0.5 : 0.3);
  struct Point {
    double x, y;
  };
  std::vector<Point> inside, outside;  // of the target
  Trial best, least;
  met = false;
  for (int i = 0; i < kMaxTrials; i++) {
    report(m.options, "allocate and code", 0.45 + 0.55 * i / kMaxTrials);
    Trial t = try_lambda(m, std::exp(x), watch);
    const double y = excess(t, m.options, bytes);
    if (getenv("TRACE")) fprintf(stderr, "trial %d x %.4f bytes %zu E %.4f y %.4f\n", i, x, t.stream.size(), t.error*1e4, y);
    if (y <= 0) {
      if (inside.empty() || y > inside.back().y) inside.push_back({x, y}), best = std::move(t);
      met = true;
      if (y > -tolerance) break;
    } else {
      if (outside.empty() || y < outside.back().y) outside.push_back({x, y}), least = std::move(t);
    }
    if (!inside.empty() && !outside.empty()) {
      const Point a = inside.back(), b = outside.back();
      slope = (b.y - a.y) / (b.x - a.x);
      // aim a little inside of the target
      x = a.x + (-0.4 * tolerance - a.y) / slope;
      const double lo = std::min(a.x, b.x), hi = std::max(a.x, b.x);
      if (!(x > lo + 0.02 * (hi - lo) && x < hi - 0.02 * (hi - lo))) x = 0.5 * (lo + hi);
      if (hi - lo < 1e-3) break;
    } else {
      x += std::clamp((-0.4 * tolerance - y) / slope, -4.0, 4.0);
    }
  }
  return met ? best : least;
}

}  // namespace

EncodeResult encode(const TriangleMesh& mesh, const EncodeOptions& options) {
  EncodeResult result;
  Stopwatch watch(result);
  Job m = {mesh, options, {}, {}, {}, {}, nullptr, 0, true, nullptr};
  prepare(m, watch);
  double bytes = double(options.bytes);
  if (!options.bytes && options.bits_per_vertex > 0)
    bytes = options.bits_per_vertex * double(mesh.positions.size()) / 8;
  Trial trial = search(m, bytes, result.target_met, watch);
  result.stream = std::move(trial.stream);
  result.error = trial.error;
  result.warnings = m.surface.warnings;
  result.labels.assign(mesh.triangles.size(), -1);
  for (size_t f = 0; f < m.surface.faces.size(); f++) {
    const int label = m.partition.label[f];
    if (label >= 0) result.labels[size_t(m.surface.source[f])] = trial.patch_number[size_t(label)];
  }
  for (int p : trial.patch_number) result.patches += p >= 0;
  report(options, "done", 1);
  return result;
}

}  // namespace relief
