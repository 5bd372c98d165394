#include "encode/job.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>

#include "seams/folds.h"

namespace relief {
namespace {

constexpr size_t kErrorSamples = 200000;  // each way
constexpr int kDiffusionRounds = 14;
constexpr double kRingReach = 10;    // mean vertex spacings around a patch that its raster sees
constexpr double kBorderReach = 64;  // likewise, around the surface's border: some of a coarse grid
constexpr double kPointHole = 2;     // likewise, least radius of a hole between points
constexpr double kCoarsest = 16;     // spacing of resolution 0, mean vertex spacings

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

// Distances from the middle of each face to what a stream decodes to, lattice units.
std::vector<float> distances_of_faces(const Job& m, const TriangleMesh& decoded) {
  std::vector<Vec3> middles;
  for (size_t f = 0; f < m.surface.faces.size(); f++) middles.push_back(middle_of(m.surface, int(f)));
  return distances(m.surface, ErrorMeter(decoded, kErrorSamples), middles);
}

// What the result is held against: the surface's topology, border and handles, and its error meter.
void survey(Job& m) {
  auto find_topology = [&] {
    m.topology = topology(in_model_units(m.surface));
    m.border = border_of(m.surface, kBorderReach * m.spacing, m.points ? kPointHole * m.spacing : 0);
    m.topology.boundary_loops = m.border.loops.size();
    m.folded = folded_vertices(m.surface);
    if (m.options.keep_handles && !m.points && m.topology.genus > 0) m.handles = handle_places(m.surface);
  };
  auto make_meter = [&] {
    if (!m.surface.bulge.empty())
      m.measured = curved_mesh(m.surface);
    else if (m.options.min_component > 0)
      m.measured = in_model_units(m.surface);
    m.meter = std::make_unique<ErrorMeter>(m.measured.triangles.empty() ? m.mesh : m.measured, kErrorSamples);
  };
  tbb::parallel_invoke(find_topology, make_meter);
}

// What a partition leaves to do before its patches can be sampled.
std::unique_ptr<Patching> gather(const Job& m, Partition partition, Stopwatch& watch) {
  auto p = std::make_unique<Patching>();
  p->partition = std::move(partition);
  p->ownership = diffuse_labels(m.surface, p->partition, kDiffusionRounds);
  p->patches = gather_patches(m.surface, p->partition, kRingReach * m.spacing);
  if (!m.points)
    for (const auto& loop : m.border.loops)
      if (const int label = p->partition.label[size_t(loop.face)]; label >= 0)
        p->patches[size_t(label)].loops.push_back(loop);
  p->allocator =
      std::make_unique<Allocator>(AllocationInput{m.surface, p->ownership, p->patches, m.border.distance,
                                                  distance_to(m), kCoarsest * m.spacing, m.options.fit});
  watch.lap("resample");
  return p;
}

}  // namespace

void Stopwatch::lap(const char* stage) {
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

Effort effort_of(int effort) {
  constexpr Effort kEfforts[] = {{0.3, 0.02, 0, 0, 1, 1, true},      {0.15, 0.02, 1, 0, 1, 1, true},
                                 {0.06, 0.01, 1, 5, 1, 1, true},     {0.03, 0.008, 3, 10, 1, 1, true},
                                 {0.015, 0.005, 3, 20, 4, 1, true},  {0.015, 0.003, 3, 40, 4, 2, false},
                                 {0.015, 0.002, 3, 60, 8, 2, false}, {0.015, 0.002, 3, 60, 8, 3, false},
                                 {0.015, 0.002, 3, 60, 16, 4, false}};
  return kEfforts[std::clamp(effort, 1, 9) - 1];
}

void report(const EncodeOptions& o, const char* stage, double done) {
  if (o.progress) o.progress(stage, done);
}

DistanceToSurface distance_to(const Job& m) {
  return [&m](const std::vector<Vec3>& points) { return distances(m.surface, *m.meter, points); };
}

SamplesWithSurface samples_with(const Job& m) {
  return [&m](const TriangleMesh& decoded) {
    MutualSamples samples = m.meter->samples(decoded);
    const double scale = m.surface.scale;
    for (auto* side : {&samples.of_original, &samples.of_other})
      for (auto& s : *side)
        s = {(s.point - m.surface.origin) / scale, s.triangle, s.square / (scale * scale),
             s.area / (scale * scale)};
    return samples;
  };
}

void partition(Job& m, Stopwatch& watch) {
  report(m.options, "partition", 0.05);
  PartitionOptions p = partition_options(m.options);
  p.progress = [&](double done) { report(m.options, "partition", 0.05 + 0.35 * done); };
  Partition partition;
  auto make_partition = [&] { partition = partition_surface(m.surface, p); };
  if (m.meter)
    make_partition();
  else  // much of either is not parallel
    tbb::parallel_invoke(make_partition, [&] { survey(m); });
  watch.lap("partition");
  report(m.options, "resample", 0.4);
  m.patching = gather(m, std::move(partition), watch);
}

void prepare(Job& m, Stopwatch& watch) {
  report(m.options, "surface", 0);
  m.surface = build_surface(m.mesh);
  if (m.options.min_component > 0) drop_components(m.mesh, m.options.min_component, m.surface);
  if (m.points) m.points->bulge(m.surface);
  m.spacing = std::sqrt(m.surface.total_area / double(m.surface.vertices.size()));
  watch.lap("surface");
}

std::unique_ptr<Patching> split_what_is_missed(const Job& m, const TriangleMesh& decoded, double error,
                                               double lambda, Stopwatch& watch) {
  constexpr double kFar = 4;      // times the error
  constexpr double kBits = 3000;  // what patches of their own take, at least
  const std::vector<float> distance = distances_of_faces(m, decoded);
  Partition partition = m.patching->partition;
  const bool any = split_missed(m.surface, partition_options(m.options),
                                {distance, kFar * error * kLatticeDiagonal, kBits * lambda}, partition);
  watch.lap("partition");
  return any ? gather(m, std::move(partition), watch) : nullptr;
}

}  // namespace relief
