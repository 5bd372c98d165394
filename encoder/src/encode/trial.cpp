#include "encode/trial.h"

#include <algorithm>
#include <cmath>

#include "code/trellis.h"
#include "surface/weld.h"

namespace relief {
namespace {

constexpr double kSamplingMargin = 0.004;  // what other samples may say, about three deviations

SeamsInput seams_input(const Job& m, Known& known) {
  const EncodeOptions& o = m.options;
  const double target = o.bytes > 0 || o.bits_per_vertex > 0 ? 0 : o.error;
  return {m.surface,
          m.topology,
          distance_to(m),
          samples_with(m),
          m.border,
          m.folded,
          m.effort.face_trials,
          m.handles,
          target * kLatticeDiagonal * std::exp(-kSamplingMargin),
          [&m](const TriangleMesh& decoded) { return m.meter->relative_rms(decoded) * kLatticeDiagonal; },
          known};
}

size_t count_coincident(const TriangleMesh& mesh) {
  const std::vector<uint32_t> first = weld_positions(mesh.positions);
  size_t count = 0;
  for (uint32_t v = 0; v < first.size(); v++) count += first[v] != v;
  return count;
}

}  // namespace

double finest_step(const std::vector<CodedPatch>& patches) {
  float largest = 0;
  for (const CodedPatch& p : patches)
    for (float v : p.image->value) largest = std::max(largest, std::fabs(v));
  return std::max(kLeastStep, double(largest) / (1 << 19));
}

Sampled sample(const Job& m, double lambda, Stopwatch& watch, double density) {
  Sampled s;
  Allocator& allocator = *m.patching->allocator;
  if (density == 0) density = m.options.density;
  const Allocator::Choice choice = density > 0 ? allocator.fixed(lambda, density) : allocator.choose(lambda);
  double spacing, step;
  s.patches = allocator.coded(choice, spacing, step, s.patch_number);
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

void mend(const Job& m, Sampled& s, const MendRounds& most, Stopwatch& watch) {
  const bool finished = mend_masks(s.patches, s.placement, seams_input(m, s.known), most, s.patch_number,
                                   s.cleaned, s.quantised);
  if (most.rounds > 0) s.mended = true, s.finished = finished;
  watch.lap("mend");
}

Trial code(const Job& m, Sampled& s, Care care, Stopwatch& watch) {
  Trial trial;
  const StreamParts parts = code_stream(s.patches, s.placement, s.quantised);
  watch.lap("code");
  FoundSeams found = find_seams(parts, s.patches, seams_input(m, s.known), care);
  trial.mesh = std::move(found.mesh);
  trial.topology = found.topology;
  trial.error = found.error / kLatticeDiagonal;
  trial.measured = found.measured;
  if (care == Care::kAll) trial.coincident = count_coincident(trial.mesh);
  trial.stream = assemble(
      parts,
      {parts.boundary_nodes, uint32_t(trial.mesh.positions.size()), uint32_t(trial.mesh.triangles.size())},
      found.seams);
  trial.patch_number = s.patch_number;
  trial.coefficient_bytes = parts.coefficients.size();
  watch.lap("decode");
  return trial;
}

void measure(const Job& m, Trial& trial, Stopwatch& watch) {
  trial.error = m.meter->relative_rms(trial.mesh);
  trial.measured = true;
  watch.lap("measure");
}

double measure_roughly(const Job& m, const Trial& trial, Stopwatch& watch) {
  constexpr size_t kShareOfSamples = 4;
  const double error = m.meter->relative_rms_from_original(trial.mesh, kShareOfSamples);
  watch.lap("measure");
  return error;
}

bool is_sound(const Job& m, const Trial& t) {
  return t.coincident == 0 && t.topology.components == m.topology.components &&
         t.topology.boundary_loops == m.topology.boundary_loops;
}

bool is_better(const Trial& a, const Trial& b, double bytes) {
  return bytes > 0 ? a.error < b.error : a.stream.size() < b.stream.size();
}

double excess(const Trial& t, const EncodeOptions& o, double bytes) {
  return bytes > 0 ? std::log(double(t.stream.size()) / bytes)
                   : std::log(t.error / o.error) + kSamplingMargin;
}

}  // namespace relief
