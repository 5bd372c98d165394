// The whole way from a mesh or a point cloud to a stream that meets its target.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <list>
#include <memory>
#include <optional>

#include "allocate/allocate.h"
#include "code/trellis.h"
#include "colours/add_colours.h"
#include "measure/surface_error.h"
#include "partition/partition.h"
#include "points/point_surface.h"
#include "relief/encoder.h"
#include "seams/seams.h"
#include "surface/weld.h"

namespace relief {
namespace {

constexpr size_t kErrorSamples = 200000;  // each way
constexpr int kDiffusionRounds = 24;
constexpr double kRingReach = 10;          // mean vertex spacings around a patch that its raster sees
constexpr double kBorderReach = 64;        // likewise, around the surface's border: some of a coarse grid
constexpr double kPointHole = 2;           // likewise, least radius of a hole between points
constexpr double kCoarsest = 16;           // spacing of resolution 0, mean vertex spacings
constexpr double kSamplingMargin = 0.004;  // what other samples may say, about three deviations
constexpr double kUsualSlope = 0.27;       // of the logarithm of error or bytes over that of lambda
constexpr double kUsualStep = 4.5;         // times spacing, over error times mean vertex spacing
constexpr int kMaxTrials = 12;
constexpr int kPatience = 3;         // trials, after which each may be twice as far from the target
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

// What an effort stands for.
struct Effort {
  double near;      // of the target, in the logarithm: that is left to the last word
  int looks;        // for what patches miss: again where new patches have made it worse
  int face_trials;  // of links between patches, see SeamsInput
  int partitions;   // of which the best is taken
};

Effort effort_of(int effort) {
  constexpr Effort kEfforts[] = {{0.3, 0, 0, 1},    {0.15, 1, 0, 1},   {0.06, 1, 5, 1},
                                 {0.03, 3, 10, 1},  {0.015, 3, 20, 1}, {0.015, 3, 40, 2},
                                 {0.015, 3, 60, 3}, {0.015, 3, 60, 5}, {0.015, 3, 60, 8}};
  return kEfforts[std::clamp(effort, 1, 9) - 1];
}

// Everything that does not depend on the target's Lagrangian parameter.
struct Job {
  const TriangleMesh& mesh;    // the input, or the triangles over its points
  const PointSurface* points;  // of a point cloud, else null
  EncodeOptions options;       // with the aperture at hand
  Effort effort;
  Surface surface = {};
  Topology topology = {};  // of the surface
  Partition partition = {};
  Ownership ownership = {};
  std::vector<PatchFaces> patches = {};
  std::unique_ptr<ErrorMeter> meter = nullptr;
  double spacing = 0;  // mean spacing of the input's vertices
  SurfaceBorder border = {};
  std::vector<SurfaceBorder::Loop> loops = {};  // of it, that must not vanish
  // the surface, where that is not the mesh: components were dropped, or faces are curved
  TriangleMesh measured = {};
  std::unique_ptr<Allocator> allocator = nullptr;
};

// The patches sampled as a Lagrangian parameter wants them, ready to be coded with any step.
struct Sampled {
  std::vector<CodedPatch> patches;
  std::vector<int> patch_number;
  StreamPlacement placement;
  std::list<CleanedPatch> cleaned;  // of patches whose masks were mended
  QuantisedImages quantised;        // with the last step
  bool mended = false;              // of more than strays
};

// One stream and what it decodes to.
struct Trial {
  double lambda = 0;
  std::vector<uint8_t> stream, unquantised;
  TriangleMesh mesh;      // what it decodes to
  double error = 0;       // of that, fraction of the diagonal; see measure
  Topology topology;      // of that
  size_t coincident = 0;  // vertices of that at another one's place; known of last words
  std::vector<int> patch_number;
  size_t coefficient_bytes = 0;  // of the stream
  Sampled sampled;               // what it was made of, of trials of the search
};

TriangleMesh in_model_units(const Surface& s, const std::vector<Vec3>& points) {
  TriangleMesh mesh;
  mesh.positions.reserve(points.size());
  for (const Vec3& v : points) {
    const Vec3 p = s.origin + s.scale * v;
    mesh.positions.push_back({float(p.x()), float(p.y()), float(p.z())});
  }
  return mesh;
}

std::vector<float> distances(const Surface& s, const ErrorMeter& meter, const std::vector<Vec3>& points) {
  std::vector<float> d = meter.distance_of_positions(in_model_units(s, points));
  for (float& x : d) x = float(x / s.scale);
  return d;
}

DistanceToSurface distance_to(const Job& m) {
  return [&m](const std::vector<Vec3>& points) { return distances(m.surface, *m.meter, points); };
}

void report(const EncodeOptions& o, const char* stage, double done) {
  if (o.progress) o.progress(stage, done);
}

// The surface after repairs, not the file.
TriangleMesh in_model_units(const Surface& s) {
  TriangleMesh mesh = in_model_units(s, s.vertices);
  for (const auto& f : s.faces) mesh.triangles.push_back({uint32_t(f[0]), uint32_t(f[1]), uint32_t(f[2])});
  return mesh;
}

// Without components of fewer than so many triangles, but for the largest.
void drop_components(const TriangleMesh& mesh, size_t least, Surface& surface) {
  std::vector<size_t> faces(surface.component_area.size(), 0);
  for (int c : surface.component) faces[size_t(c)]++;
  const size_t largest = faces.empty() ? 0 : *std::max_element(faces.begin(), faces.end());
  const auto dropped =
      std::count_if(faces.begin(), faces.end(), [&](size_t n) { return n < std::min(least, largest); });
  if (dropped == 0) return;
  TriangleMesh kept;
  kept.positions = mesh.positions;
  std::vector<int> source;
  for (size_t f = 0; f < surface.faces.size(); f++)
    if (faces[size_t(surface.component[f])] >= std::min(least, largest)) {
      source.push_back(surface.source[f]);
      kept.triangles.push_back(mesh.triangles[size_t(surface.source[f])]);
    }
  std::vector<std::string> warnings = std::move(surface.warnings);
  warnings.push_back("dropped " + std::to_string(dropped) + " small component" + (dropped > 1 ? "s" : "") +
                     ", " + std::to_string(surface.faces.size() - source.size()) + " triangles, as asked");
  surface = build_surface(kept);
  for (int& s : surface.source) s = source[size_t(s)];
  surface.warnings = std::move(warnings);
}

PartitionOptions partition_options(const EncodeOptions& o) {
  PartitionOptions p;
  p.aperture = o.aperture;
  p.clustering = o.clustering;
  p.plane = o.plane;
  return p;
}

// What the partition leaves to do before patches can be sampled.
void gather(Job& m, Stopwatch& watch) {
  m.ownership = diffuse_labels(m.surface, m.partition, kDiffusionRounds);
  m.patches = gather_patches(m.surface, m.partition, kRingReach * m.spacing);
  m.allocator = std::make_unique<Allocator>(AllocationInput{m.surface, m.ownership, m.patches, distance_to(m),
                                                            m.loops, kCoarsest * m.spacing, m.options.fit});
  watch.lap("resample");
}

void partition(Job& m, Stopwatch& watch) {
  report(m.options, "partition", 0.05);
  PartitionOptions p = partition_options(m.options);
  p.progress = [&](double done) { report(m.options, "partition", 0.05 + 0.35 * done); };
  m.partition = partition_surface(m.surface, p);
  watch.lap("partition");
  report(m.options, "resample", 0.4);
  gather(m, watch);
}

void prepare(Job& m, Stopwatch& watch) {
  report(m.options, "surface", 0);
  m.surface = build_surface(m.mesh);
  if (m.options.min_component > 0) drop_components(m.mesh, m.options.min_component, m.surface);
  if (m.points) m.points->bulge(m.surface);
  m.spacing = std::sqrt(m.surface.total_area / double(m.surface.vertices.size()));
  m.topology = topology(in_model_units(m.surface));
  m.border = border_of(m.surface, kBorderReach * m.spacing, m.points ? kPointHole * m.spacing : 0);
  if (!m.points) m.loops = m.border.loops;
  m.topology.boundary_loops = m.border.loops.size();
  watch.lap("surface");
  if (!m.surface.bulge.empty())
    m.measured = curved_mesh(m.surface);
  else if (m.options.min_component > 0)
    m.measured = in_model_units(m.surface);
  m.meter = std::make_unique<ErrorMeter>(m.measured.triangles.empty() ? m.mesh : m.measured, kErrorSamples);
  watch.lap("measure");
}

SeamsInput seams_input(const Job& m) {
  return {m.surface, m.topology, distance_to(m), m.border, m.effort.face_trials};
}

// The finest step that these patches can be coded with: magnitudes stay below 2^20, and so does what LL
// differs from its prediction by.
double finest_step(const std::vector<CodedPatch>& patches) {
  float largest = 0;
  for (const CodedPatch& p : patches)
    for (float v : p.image->value) largest = std::max(largest, std::fabs(v));
  return std::max(kLeastStep, double(largest) / (1 << 19));
}

Sampled sample(const Job& m, double lambda, Stopwatch& watch) {
  Sampled s;
  const Allocator::Choice choice =
      m.options.density > 0 ? m.allocator->fixed(lambda, m.options.density) : m.allocator->choose(lambda);
  double spacing, step;
  s.patches = m.allocator->coded(choice, spacing, step, s.patch_number);
  if (s.patches.empty()) throw InputError("the surface is too small or too thin to be sampled");
  const bool bisk = m.options.coder == Coder::kBisk;
  step = std::max(bisk ? step : kTrellisStep * step, finest_step(s.patches));
  const float trade = bisk ? float(kTrade) : trellis_trade(kTrade);
  s.placement = {{}, float(m.surface.scale), float(spacing), float(step), trade, m.border.loops.empty()};
  s.placement.bisk = bisk;
  s.placement.even = m.options.allocation == Allocation::kEven;
  for (int k = 0; k < 3; k++) s.placement.origin[k] = float(m.surface.origin[k]);
  watch.lap("allocate");
  return s;
}

void mend(const Job& m, Sampled& s, int rounds, Stopwatch& watch) {
  mend_masks(s.patches, s.placement, seams_input(m), rounds, s.patch_number, s.cleaned, s.quantised);
  s.mended = rounds > 0;
  watch.lap("mend");
}

size_t count_coincident(const TriangleMesh& mesh) {
  const std::vector<uint32_t> first = weld_positions(mesh.positions);
  size_t count = 0;
  for (uint32_t v = 0; v < first.size(); v++) count += first[v] != v;
  return count;
}

// thorough: the last word on a stream, see find_seams.
Trial code(const Job& m, Sampled& s, bool thorough, Stopwatch& watch) {
  Trial trial;
  const StreamParts parts = code_stream(s.patches, s.placement, s.quantised);
  watch.lap("code");
  FoundSeams found = find_seams(parts, s.patches, seams_input(m), thorough);
  trial.mesh = std::move(found.mesh);
  trial.topology = found.topology;
  if (thorough) trial.coincident = count_coincident(trial.mesh);
  trial.stream = assemble(
      parts,
      {parts.boundary_nodes, uint32_t(trial.mesh.positions.size()), uint32_t(trial.mesh.triangles.size())},
      found.seams);
  trial.patch_number = s.patch_number;
  trial.coefficient_bytes = parts.coefficients.size();
  watch.lap("decode");
  return trial;
}

double measure(const Job& m, const Trial& trial, Stopwatch& watch) {
  const double error = m.meter->relative_rms(trial.mesh);
  watch.lap("measure");
  return error;
}

// How a trial stands to the target: 0 on it, positive beyond it (error too large, too many bytes), in the
// logarithm. Another set of samples may measure the error a little larger: it counts with a margin.
double excess(const Trial& t, const EncodeOptions& o, double bytes) {
  return bytes > 0 ? std::log(double(t.stream.size()) / bytes)
                   : std::log(t.error / o.error) + kSamplingMargin;
}

// The thorough trial of these patches with the step, or of bisk the cut, that just keeps within the target:
// with the masks held, error and bytes follow it smoothly. met: whether any trial did; then also whether this
// one does.
Trial settle(const Job& m, Sampled s, double bytes, bool& met, Stopwatch& watch) {
  constexpr int kMost = 7, kMendRounds = 2, kVain = 3;
  constexpr double kInside = 0.008, kAim = 0.002, kHopeless = 0.02;  // of the target, in the logarithm
  const bool bisk = s.placement.bisk;
  // slope of the excess y over x, the logarithm of the step or of the bytes of coefficients
  const double usual = bisk ? (bytes > 0 ? 0.85 : -0.9) : bytes > 0 ? -0.9 : 0.6;
  Trial best;
  double best_y = INFINITY, inside_x = 0, inside_y = -INFINITY, outside_x = 0, outside_y = INFINITY;
  double x = std::log(double(s.placement.step));
  auto measured = [&](Trial& t) {
    t.error = measure(m, t, watch);
    return excess(t, m.options, bytes);
  };
  if (!s.mended) mend(m, s, kMendRounds, watch);
  const double finest = finest_step(s.patches);
  for (int i = 0; i < kMost; i++) {
    if (!bisk)
      s.placement.step = float(std::clamp(std::exp(x), finest, kMostStep));
    else if (i > 0)
      s.placement.coefficient_bytes = std::max<size_t>(1, size_t(std::exp(x)));
    Trial t = code(m, s, true, watch);
    if (bisk) x = std::log(double(std::max<size_t>(1, t.coefficient_bytes)));
    double y = measured(t);
    const bool near = y <= 0 && y > -kInside;
    if ((i > 0 && near) || t.coincident > 0) {  // mended for another step
      mend(m, s, near ? kMendRounds : 0, watch);
      Trial again = code(m, s, true, watch);
      if (again.stream != t.stream) t = std::move(again), y = measured(t);
    }
    if (y <= 0 && y > inside_y) inside_x = x, inside_y = y;
    if (y > 0 && y < outside_y) outside_x = x, outside_y = y;
    // vertices at one place are one to many programs, and the surface no manifold
    const bool apart = t.coincident == 0, best_apart = best.coincident == 0;
    const bool nearer = best_y > 0 ? y < best_y : y <= 0 && y > best_y;
    if (i == 0 || (apart == best_apart ? nearer : apart)) best = std::move(t), best_y = y;
    if (!met || (best_y <= 0 && best_y > -kInside)) break;
    if (i + 1 == kVain && best_y > kHopeless) break;
    const bool bracket = inside_y > -INFINITY && outside_y < INFINITY;
    const double aim = kAim * (i + 1);  // deeper inside with every trial in vain
    const double slope = bracket ? (outside_y - inside_y) / (outside_x - inside_x) : usual;
    x = bracket ? inside_x - (inside_y + aim) / slope : x + std::clamp(-(y + aim) / slope, -0.3, 0.3);
  }
  met = best_y <= 0;
  if (m.options.unquantised) {
    s.placement.step = float(finest);
    s.placement.trade = 0;
    s.quantised = {};
    s.placement.coefficient_bytes = SIZE_MAX;
    best.unquantised = code(m, s, true, watch).stream;
  }
  return best;
}

// Where sampling alone errs too much, no step helps: then with another lambda.
Trial last_word(const Job& m, Trial nearest, double bytes, bool& met, Stopwatch& watch) {
  constexpr int kMost = 4;
  constexpr double kFurther = 0.02;  // inside of the target, more with every trial
  const double slope = (bytes > 0 ? -1 : 1) * kUsualSlope;
  double lambda = nearest.lambda;
  const bool reachable = met;
  Trial t = settle(m, std::move(nearest.sampled), bytes, met, watch);
  for (int i = 1; i < kMost && reachable && !met; i++) {
    lambda *= std::exp(-(excess(t, m.options, bytes) + kFurther * i) / slope);
    met = true;
    t = settle(m, sample(m, lambda, watch), bytes, met, watch);
  }
  return t;
}

// Distances from the middle of each face to what a stream decodes to, lattice units.
std::vector<float> distances_of_faces(const Job& m, const TriangleMesh& decoded) {
  const auto& v = m.surface.vertices;
  std::vector<Vec3> middles;
  for (const auto& f : m.surface.faces)
    middles.push_back((v[size_t(f[0])] + v[size_t(f[1])] + v[size_t(f[2])]) / 3);
  return distances(m.surface, ErrorMeter(decoded, kErrorSamples), middles);
}

// Makes patches of what a trial of this error misses, if there is anything worth its bytes.
bool split_what_is_missed(Job& m, const Trial& t, double error, Stopwatch& watch) {
  constexpr double kFar = 4;      // times the error
  constexpr double kBits = 3000;  // what patches of their own take, at least
  const std::vector<float> distance = distances_of_faces(m, t.mesh);
  const PartitionOptions p = partition_options(m.options);
  const bool any =
      split_missed(m.surface, p, {distance, kFar * error * kLatticeDiagonal, kBits * t.lambda}, m.partition);
  watch.lap("partition");
  if (any) gather(m, watch);
  return any;
}

// Where the target lies, as far as trials tell: logarithms of lambda with the excess there.
struct Bracket {
  struct Point {
    double x, y;
  };
  double least, most;  // x that are tried
  double slope;        // of y over x
  std::optional<Point> inside = std::nullopt, outside = std::nullopt;

  void add(double x, double y) { (y <= 0 ? inside : outside) = Point{x, y}; }

  // The next x to try after this one, which is the same if there is nothing left to try.
  double next(double x, double y) {
    if (!inside || !outside) return std::clamp(x + std::clamp(-y / slope, -3.0, 3.0), least, most);
    const double lo = std::min(inside->x, outside->x), hi = std::max(inside->x, outside->x);
    if (hi - lo < kNarrowest) return x;
    // aim at the target, but keep the bracket shrinking
    slope = (outside->y - inside->y) / (outside->x - inside->x);
    return std::clamp(inside->x - inside->y / slope, lo + 0.15 * (hi - lo), hi - 0.15 * (hi - lo));
  }
};

Bracket all_lambdas(const Job& m, double slope) {
  const double trade = std::log(kTrade);
  return {trade + 2 * std::log(kFinestStep * m.spacing), trade + 2 * std::log(kCoarsestStep * m.spacing),
          slope};
}

// A stream for the search. Once patches were split it is mended, too: small patches make many mistakes.
Trial try_lambda(const Job& m, double lambda, bool mended, Stopwatch& watch) {
  constexpr int kMendRounds = 3;
  Sampled sampled = sample(m, lambda, watch);
  if (mended) mend(m, sampled, kMendRounds, watch);
  Trial t = code(m, sampled, false, watch);
  t.error = measure(m, t, watch);
  t.lambda = lambda;
  t.sampled = std::move(sampled);
  return t;
}

// The logarithm of what a trial would take at another error, but for a constant: errors of gaps jump from
// trial to trial.
double cost(const Trial& t) {
  constexpr double kBytesByError = 1.2;  // slope of bytes over error, in logarithms
  return std::log(double(t.stream.size())) + kBytesByError * std::log(t.error);
}

// Of two trials the last word takes the one of lower rank: of those near the target the one of lower cost,
// else the nearest inside of it, else the nearest.
constexpr double kNotNear = 1e3, kOutside = 2e3;
double rank(const Trial& t, double y, double near) {
  constexpr double kWithin = 0.12;
  if (y >= near) return kOutside + y;
  return y < -kWithin ? kNotNear - y : cost(t);
}

// The search for the Lagrangian parameter, in its logarithm. The first trial near the target tells what
// patches miss.
class Search {
 public:
  Search(Job& m, double bytes, Stopwatch& watch)
      : m_(m), bytes_(bytes), watch_(watch), bracket_(all_lambdas(m, (bytes > 0 ? -1 : 1) * kUsualSlope)) {
    const double target = bytes > 0 ? 1e-4 : m.options.error;
    const double step = target * kLatticeDiagonal * kUsualStep * m.spacing;  // times spacing
    x_ = std::clamp(std::log(kTrade * step * step), bracket_.least, bracket_.most);
  }

  // Bisection (3.6), with the secant as the first guess, until a trial is near the target; the last word does
  // the rest.
  Trial run(bool& met) {
    for (int i = 0; i < kMaxTrials; i++) {
      report(m_.options, "allocate and code", 0.45 + 0.55 * i / kMaxTrials);
      Trial t = try_lambda(m_, std::exp(x_), split_, watch_);
      const double y = excess(t, m_.options, bytes_);
      if (changes_patches(t, y)) continue;
      const double near = m_.effort.near * std::exp2(std::max(0, i + 1 - kPatience));
      bracket_.add(x_, y);
      const double next = bracket_.next(x_, y), r = rank(t, y, near);
      if (r < best_rank_) best_rank_ = r, best_ = std::move(t);
      if (std::fabs(y) < near || next == x_) break;
      x_ = next;
    }
    met = best_rank_ < kOutside;
    return last_word(m_, std::move(best_), bytes_, met, watch_);
  }

 private:
  // Splits what patches miss, looks again where that did not help yet, and takes it back where it did harm.
  // True: the trial is of other patches than the next.
  bool changes_patches(const Trial& t, double y) {
    constexpr double kNearToSplit = 0.5, kHarm = 0.03;
    if (looks_ == 0) {
      if (m_.effort.looks == 0 || std::fabs(y) >= kNearToSplit) return false;
      looks_++, first_error_ = t.error, first_cost_ = cost(t);
      whole_ = m_.partition;
      if (!split_what_is_missed(m_, t, first_error_, watch_)) return false;
      split_ = true;
      before_ = std::exchange(bracket_, all_lambdas(m_, bracket_.slope));
      before_.add(x_, y);
      x_ = bracket_.next(x_, y);
    } else if (split_ && t.error > first_error_ && looks_ < m_.effort.looks &&
               cost(t) < first_cost_ + kHarm) {
      looks_++;
      if (!split_what_is_missed(m_, t, first_error_, watch_)) return false;
      bracket_ = all_lambdas(m_, bracket_.slope);
    } else if (split_ && cost(t) > first_cost_ + kHarm) {
      split_ = false, looks_ = m_.effort.looks;
      m_.partition = std::move(whole_);
      gather(m_, watch_);
      bracket_ = before_;
      x_ = bracket_.next(x_, y);
    } else {
      return false;
    }
    best_rank_ = INFINITY;
    return true;
  }

  Job& m_;
  const double bytes_;  // the target; 0: it is one of error
  Stopwatch& watch_;
  Bracket bracket_;
  double x_;  // of the next trial
  Trial best_;
  double best_rank_ = INFINITY;
  int looks_ = 0;  // for what is missed
  bool split_ = false;
  // What it was before the split, and what the last trial then was.
  Partition whole_;
  Bracket before_ = bracket_;
  double first_error_ = 0, first_cost_ = 0;
};

// A line for what the stream could not keep of the surface's topology.
void warn_of_topology(const Topology& is, const Topology& should, std::vector<std::string>& warnings) {
  auto compare = [&](const char* what, int64_t got, int64_t wanted) {
    if (got != wanted)
      warnings.push_back(std::string("the result has ") + what + " " + std::to_string(got) +
                         ", the surface " + std::to_string(wanted));
  };
  compare("components:", int64_t(is.components), int64_t(should.components));
  compare("boundary loops:", int64_t(is.boundary_loops), int64_t(should.boundary_loops));
  compare("genus:", is.genus, should.genus);
}

// A result, and what it was made from.
struct Outcome {
  Trial trial;
  bool met = false;
  std::vector<int> label;  // of the faces of the surface
};

// The best of the partitions that the effort is for: which aperture suits a surface cannot be told
// beforehand.
Outcome best_partition(Job& m, const EncodeOptions& asked, double bytes, Stopwatch& watch) {
  constexpr double kTurns[] = {0, -5, 5, -2.5, -7.5, 2.5, -10, 7.5};  // of the aperture, degrees
  Outcome best;
  for (int i = 0; i < m.effort.partitions; i++) {
    m.options.aperture = std::clamp(asked.aperture + kTurns[i], 1.0, 89.0);
    if (asked.progress)
      m.options.progress = [&, i](const char* stage, double done) {
        asked.progress(stage, (i + done) / m.effort.partitions);
      };
    partition(m, watch);
    Outcome o;
    o.trial = Search(m, bytes, watch).run(o.met);
    o.label = m.partition.label;
    const bool smaller =
        bytes > 0 ? o.trial.error < best.trial.error : o.trial.stream.size() < best.trial.stream.size();
    if (i == 0 || (o.met != best.met ? o.met : smaller)) best = std::move(o);
  }
  return best;
}

// The target, if it is one of bytes; else 0.
double wanted_bytes(const TriangleMesh& input, const EncodeOptions& options) {
  if (options.bytes || options.bits_per_vertex <= 0) return double(options.bytes);
  return options.bits_per_vertex * double(input.positions.size()) / 8;
}

void code_colours(const TriangleMesh& input, const EncodeOptions& options, double bytes,
                  EncodeResult& result) {
  const size_t surface_bytes = result.stream.size();
  report(options, "colours", 0.99);
  const CodedColours coded = add_colours(input, {options.color_error, size_t(bytes)}, result.stream);
  result.color_error = coded.error;
  result.color_bytes = result.stream.size() - surface_bytes;
  result.target_met = result.target_met && coded.met;
}

// The surface and its colours. Where bytes are the target, the surface takes what colours leave: all but
// their usual share at first, then, if they could do with less, once more all but that.
Outcome encode_coloured(Job& m, const TriangleMesh& input, const EncodeOptions& asked, EncodeResult& result,
                        Stopwatch& watch) {
  constexpr double kColourShare = 0.3, kFull = 0.985;
  const bool coloured = !input.colors.empty() && asked.color_error > 0;
  const double all = wanted_bytes(input, asked);
  double bytes = all * (coloured ? 1 - kColourShare : 1);
  for (bool last = !coloured || all == 0;; last = true) {
    Outcome best = best_partition(m, asked, bytes, watch);
    result.target_met = best.met && excess(best.trial, asked, bytes) <= 0;
    result.stream = best.trial.stream;
    if (coloured) {
      code_colours(input, asked, all, result);
      watch.lap("colours");
    }
    if (last || double(result.stream.size()) >= kFull * all) return best;
    bytes = all - double(result.color_bytes);
  }
}

// With progress that never falls, whoever reports it.
EncodeOptions with_rising_progress(EncodeOptions options) {
  if (!options.progress) return options;
  options.progress = [report = options.progress, most = std::make_shared<double>(0)](const char* stage,
                                                                                     double done) {
    *most = std::max(*most, done);
    report(stage, *most);
  };
  return options;
}

}  // namespace

EncodeResult encode(const TriangleMesh& input, const EncodeOptions& options) {
  EncodeResult result;
  Stopwatch watch(result);
  std::optional<PointSurface> points;
  if (input.triangles.empty()) {
    report(options, "points", 0);
    points.emplace(input);
    watch.lap("points");
  }
  const TriangleMesh& mesh = points ? points->mesh() : input;
  const EncodeOptions asked = with_rising_progress(options);
  Job m = {mesh, points ? &*points : nullptr, asked, effort_of(options.effort)};
  prepare(m, watch);
  Outcome best = encode_coloured(m, input, asked, result, watch);
  Trial& trial = best.trial;
  result.unquantised = std::move(trial.unquantised);
  result.error = trial.error;
  if (points) {
    const auto& more = points->warnings();
    result.warnings.insert(result.warnings.end(), more.begin(), more.end());
  }
  result.warnings.insert(result.warnings.end(), m.surface.warnings.begin(), m.surface.warnings.end());
  warn_of_topology(trial.topology, m.topology, result.warnings);
  result.labels.assign(input.triangles.size(), -1);
  for (size_t f = 0; f < m.surface.faces.size() && !points; f++) {
    const int label = best.label[f];
    if (label >= 0) result.labels[size_t(m.surface.source[f])] = trial.patch_number[size_t(label)];
  }
  for (int p : trial.patch_number) result.patches += p >= 0;
  report(options, "done", 1);
  return result;
}

}  // namespace relief
