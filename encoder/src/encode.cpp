// The whole way from a mesh to a stream that meets its target.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

#include "allocate/allocate.h"
#include "measure/surface_error.h"
#include "partition/partition.h"
#include "relief/encoder.h"
#include "seams.h"
#include "specks.h"

namespace relief {
namespace {

// Samples each way while searching, and for the last word: a few of them on thin parts carry much of the error.
constexpr size_t kErrorSamples = 300000, kFinalSamples = 1200000, kFewestSamples = 60000;
constexpr int kDiffusionRounds = 24;
constexpr double kRingReach = 10;  // mean vertex spacings around a patch that its raster sees
constexpr double kCoarsest = 16;   // spacing of resolution 0, mean vertex spacings
constexpr double kSamplingMargin = 0.008;
constexpr int kMaxTrials = 12;
constexpr double kNarrowest = 0.01;  // of the bracket, in the logarithm of lambda
// Steps that are tried, in lattice units at the mean vertex spacing: the format's finest is 1/64 at any
// patch.
constexpr double kFinestStep = 2, kCoarsestStep = 1 << 16;

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
  Topology topology;  // of the surface
  Partition partition;
  Ownership ownership;
  std::vector<PatchFaces> patches;
  std::unique_ptr<ErrorMeter> meter, final_meter;
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

// The topology is that of the surface after repairs, not of the file.
TriangleMesh as_mesh(const Surface& s) {
  TriangleMesh mesh;
  for (const Vec3& v : s.vertices) mesh.positions.push_back({float(v.x()), float(v.y()), float(v.z())});
  for (const auto& f : s.faces) mesh.triangles.push_back({uint32_t(f[0]), uint32_t(f[1]), uint32_t(f[2])});
  return mesh;
}

void prepare(Job& m, Stopwatch& watch) {
  report(m.options, "surface", 0);
  m.surface = build_surface(m.mesh);
  for (const auto& a : m.surface.adjacent) m.closed = m.closed && a[0] >= 0 && a[1] >= 0 && a[2] >= 0;
  m.spacing = std::sqrt(m.surface.total_area / double(m.surface.vertices.size()));
  m.topology = topology(as_mesh(m.surface));
  watch.lap("surface");
  auto samples = [&](size_t most) { return std::clamp(8 * m.surface.faces.size(), kFewestSamples, most); };
  m.meter = std::make_unique<ErrorMeter>(m.mesh, samples(kErrorSamples));
  m.final_meter = std::make_unique<ErrorMeter>(m.mesh, samples(kFinalSamples));
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

// thorough: the last word on a stream, see find_seams.
Trial try_lambda(const Job& m, double lambda, bool thorough, Stopwatch& watch) {
  Trial trial;
  trial.lambda = lambda;
  const Allocator::Choice choice =
      m.options.density > 0 ? m.allocator->fixed(lambda, m.options.density) : m.allocator->choose(lambda);
  double spacing, step;
  std::vector<CodedPatch> patches = m.allocator->coded(choice, spacing, step, trial.patch_number);
  watch.lap("allocate");
  if (patches.empty()) throw InputError("the surface is too small or too thin to be sampled");
  StreamPlacement placement = {{},          float(m.surface.scale), float(spacing),
                               float(step), float(kTrade),          m.closed};
  for (int k = 0; k < 3; k++) placement.origin[k] = float(m.surface.origin[k]);
  StreamParts parts = code_stream(patches, placement);
  watch.lap("code");
  DecodedMesh decoded;
  const SeamsInput input = {m.surface, m.topology, distance_to(m), m.closed, spacing};
  std::list<CleanedPatch> cleaned;
  if (thorough) {
    find_seams(parts, input, false, decoded);
    if (remove_specks(decoded, m.topology.components, patches, trial.patch_number, cleaned))
      parts = code_stream(patches, placement);
  }
  const Seams seams = find_seams(parts, input, thorough, decoded);
  const TriangleMesh& result = decoded.mesh;
  trial.stream = assemble(
      parts, {parts.boundary_nodes, uint32_t(result.positions.size()), uint32_t(result.triangles.size())},
      seams);
  watch.lap("decode");
  const SurfaceError e = (thorough ? m.final_meter : m.meter)->measure(result);
  trial.error = e.rms / e.diagonal;
  watch.lap("measure");
  return trial;
}

// How a trial stands to the target: 0 on it, positive beyond it (error too large, too many bytes), in the
// logarithm. Another set of samples may measure the error a little larger: it counts with a margin.
double excess(const Trial& t, const EncodeOptions& o, double bytes) {
  return bytes > 0 ? std::log(double(t.stream.size()) / bytes)
                   : std::log(t.error / o.error) + kSamplingMargin;
}

// Bisection on the Lagrangian parameter (3.6), in its logarithm, with the secant as the first guess. Ends
// with the best trial that keeps within the target, at most 1% (bytes) or 2% (error) inside where streams are
// that dense.
Trial search(const Job& m, double bytes, bool& met, Stopwatch& watch) {
  const double tolerance = bytes > 0 ? 0.01 : 0.02;
  const double direction = bytes > 0 ? -1 : 1;  // excess rises with lambda for errors, falls for bytes
  double guess = m.options.error * kLatticeDiagonal * 4.5 * m.spacing;  // step * spacing for the error
  if (bytes > 0) guess = 1e-4 * kLatticeDiagonal * 4.5 * m.spacing;
  double x = std::log(kTrade * guess * guess);
  const double least_x = std::log(kTrade) + 2 * std::log(kFinestStep * m.spacing);
  const double most_x = std::log(kTrade) + 2 * std::log(kCoarsestStep * m.spacing);
  x = std::clamp(x, least_x, most_x);
  double slope = direction * (bytes > 0 ? 0.5 : 0.3);
  struct Point {
    double x, y;
  };
  std::optional<Point> inside, outside;  // of the target: the bracket
  Trial best, least;                     // inside and outside, nearest to the target
  double best_y = -INFINITY, least_y = INFINITY;
  met = false;
  for (int i = 0; i < kMaxTrials; i++) {
    report(m.options, "allocate and code", 0.45 + 0.55 * i / kMaxTrials);
    Trial t = try_lambda(m, std::exp(x), false, watch);
    const double y = excess(t, m.options, bytes);
    if (y <= 0 && y > -tolerance) {
      Trial full = try_lambda(m, std::exp(x), true, watch);
      met = true;
      if (excess(full, m.options, bytes) <= 0) return full;
      best = std::move(t);
      break;
    }
    (y <= 0 ? inside : outside) = Point{x, y};
    if (y <= 0 && y > best_y)
      best_y = y, best = std::move(t);
    else if (y > 0 && y < least_y)
      least_y = y, least = std::move(t);
    met = best_y > -INFINITY;
    if (inside && outside) {
      const double lo = std::min(inside->x, outside->x), hi = std::max(inside->x, outside->x);
      if (hi - lo < kNarrowest) break;
      // aim a little inside of the target, but keep the bracket shrinking
      slope = (outside->y - inside->y) / (outside->x - inside->x);
      x = inside->x + (-0.4 * tolerance - inside->y) / slope;
      x = std::clamp(x, lo + 0.15 * (hi - lo), hi - 0.15 * (hi - lo));
    } else {
      const double next =
          std::clamp(x + std::clamp((-0.4 * tolerance - y) / slope, -3.0, 3.0), least_x, most_x);
      if (next == x) break;  // as fine or as coarse as streams get
      x = next;
    }
  }
  // the last word on the seams may move the error a little: step back from the target if so
  const double step_back[] = {0, 0.03, 0.1};
  for (double back : step_back) {
    Trial last = try_lambda(m, (met ? best.lambda : least.lambda) * std::exp(-direction * back), true, watch);
    if (!met || excess(last, m.options, bytes) <= 0) return last;
  }
  return best;
}

}  // namespace

EncodeResult encode(const TriangleMesh& mesh, const EncodeOptions& options) {
  EncodeResult result;
  Stopwatch watch(result);
  Job m = {mesh, options, {}, {}, {}, {}, {}, nullptr, nullptr, 0, true, nullptr};
  prepare(m, watch);
  double bytes = double(options.bytes);
  if (!options.bytes && options.bits_per_vertex > 0)
    bytes = options.bits_per_vertex * double(mesh.positions.size()) / 8;
  Trial trial = search(m, bytes, result.target_met, watch);
  result.target_met = result.target_met && excess(trial, options, bytes) <= 0;
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
