// What an encode works on, whatever the target's Lagrangian parameter.
#pragma once
#include <chrono>
#include <memory>
#include <vector>

#include "allocate/allocate.h"
#include "measure/surface_error.h"
#include "measure/topology.h"
#include "partition/partition.h"
#include "points/point_surface.h"
#include "relief/encoder.h"
#include "seams/seams.h"
#include "surface/border.h"
#include "surface/handle_places.h"

namespace relief {

class Stopwatch {
 public:
  explicit Stopwatch(EncodeResult& result) : result_(result), last_(Clock::now()) {}
  void lap(const char* stage);  // adds the time since the last lap to this stage's

 private:
  using Clock = std::chrono::steady_clock;
  EncodeResult& result_;
  Clock::time_point last_;
};

// What an effort stands for.
struct Effort {
  double near;      // of the target, in the logarithm: that is left to the last word
  double inside;    // of the target, likewise, that the result may be
  int looks;        // for what patches miss: again where new patches have made it worse
  int face_trials;  // of links between patches, see SeamsInput
  int partitions;   // that are searched, fewer of large surfaces if `limited`
  int settled;      // of these, the most promising, of which the best is taken
  bool limited;     // to about the time that the first partition of a large surface takes
};

Effort effort_of(int effort);  // 1 .. 9; others count as the nearest

// A partition of the surface, and what sampling its patches takes.
struct Patching {
  Partition partition;
  Ownership ownership;
  std::vector<PatchFaces> patches;
  std::unique_ptr<Allocator> allocator;  // refers to the others
};

// Everything that does not depend on the target's Lagrangian parameter.
struct Job {
  const TriangleMesh& mesh;    // the input, or the triangles over its points
  const PointSurface* points;  // of a point cloud, else null
  EncodeOptions options;       // with the aperture at hand
  Effort effort;
  Surface surface = {};
  Topology topology = {};  // of the surface
  std::unique_ptr<ErrorMeter> meter = nullptr;
  double spacing = 0;  // mean spacing of the input's vertices
  SurfaceBorder border = {};
  std::vector<Vec3> folded = {};          // see folded_vertices
  std::vector<HandlePlace> handles = {};  // that are to be kept
  // the surface, where that is not the mesh: components were dropped, or faces are curved
  TriangleMesh measured = {};
  std::unique_ptr<Patching> patching = nullptr;
};

void report(const EncodeOptions& o, const char* stage, double done);

DistanceToSurface distance_to(const Job& m);

SamplesWithSurface samples_with(const Job& m);

// The surface.
void prepare(Job& m, Stopwatch& watch);

// Its patches, ready to be sampled; when called first, also what else a job knows of the surface.
void partition(Job& m, Stopwatch& watch);

// The patches at hand and others for what the result of a trial misses that has this error and came of this
// Lagrangian parameter; null if nothing of that is worth its bytes.
std::unique_ptr<Patching> split_what_is_missed(const Job& m, const TriangleMesh& decoded, double error,
                                               double lambda, Stopwatch& watch);

}  // namespace relief
