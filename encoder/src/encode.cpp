// The whole way from a mesh or a point cloud to a stream that meets its target.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "colours/add_colours.h"
#include "encode/search.h"
#include "encode/settle.h"
#include "relief/encoder.h"

namespace relief {
namespace {

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

// The apertures of the partitions that are searched, each once. Small surfaces take little time for each.
std::vector<double> apertures_of(const Job& m, double asked) {
  constexpr size_t kFaces = 1100000;  // of all partitions together
  constexpr double kTurns[] = {0,    -5,    5,   -2.5, -7.5, 2.5,  -10, 7.5,
                               -1.5, -6.25, 1.5, -3.5, 3.5,  -8.5, -4,  6};  // degrees
  const size_t faces = std::max<size_t>(1, m.surface.faces.size()), most = size_t(m.effort.partitions);
  const size_t n = m.effort.limited ? std::clamp<size_t>(kFaces / faces, 1, most) : most;
  std::vector<double> apertures;
  for (double turn : kTurns) {
    const double a = std::clamp(asked + turn, 1.0, 89.0);
    const bool fresh = std::find(apertures.begin(), apertures.end(), a) == apertures.end();
    if (fresh && apertures.size() < n) apertures.push_back(a);
  }
  return apertures;
}

// Searches of partitions with one aperture or another, the most promising first: which suits a surface cannot
// be told beforehand, and up to a tenth of the bytes depends on it. What searches find tells what is left
// after the last word, within a percent.
std::vector<Found> search_partitions(Job& m, const EncodeOptions& asked, double bytes, Stopwatch& watch) {
  constexpr int kSpare = 2;  // kept beyond those to settle: searches measure roughly, a promise may be empty
  std::vector<Found> found;
  double lambda = 0;
  constexpr double kNearEnough = 0.045;  // of the target, for a search that is compared with no other
  const std::vector<double> apertures = apertures_of(m, asked.aperture);
  if (apertures.size() == 1) m.effort.near = std::max(m.effort.near, kNearEnough);
  for (size_t i = 0; i < apertures.size(); i++) {
    m.options.aperture = apertures[i];
    if (asked.progress)
      m.options.progress = [&asked, i, n = apertures.size()](const char* stage, double done) {
        asked.progress(stage, (double(i) + done) / double(n + 1));
      };
    partition(m, watch);
    const size_t settled = size_t(m.effort.settled);
    const bool enough = found.size() >= settled && found[settled - 1].met;
    found.push_back(search(m, bytes, lambda, enough ? found[settled - 1].cost : INFINITY, watch));
    if (i == 0) lambda = found[0].trial.lambda;
    std::stable_sort(found.begin(), found.end(),
                     [](const Found& a, const Found& b) { return a.met != b.met ? a.met : a.cost < b.cost; });
    if (found.size() > settled + kSpare) found.pop_back();
  }
  return found;
}

// The best result of the most promising partitions, and of others if none of those is as it should be.
Outcome best_partition(Job& m, const EncodeOptions& asked, double bytes, Stopwatch& watch) {
  std::vector<Found> found = search_partitions(m, asked, bytes, watch);
  Outcome best;
  bool good = false;  // the best meets the target and is sound
  for (size_t i = 0; i < found.size() && (i < size_t(m.effort.settled) || !good); i++) {
    report(asked, "settle", 0.8 + 0.19 * double(i) / double(found.size()));
    m.patching = std::move(found[i].patching);
    Outcome o;
    o.met = found[i].met;
    o.label = m.patching->partition.label;
    o.trial = last_word(m, std::move(found[i].trial), bytes, o.met, watch);
    const bool well = o.met && is_sound(m, o.trial);
    const bool better = well != good        ? well
                        : o.met != best.met ? o.met
                                            : is_better(o.trial, best.trial, bytes);
    if (i == 0 || better) best = std::move(o), good = well;
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
