// Lagrangian bit allocation (3.6), including the choice of grid resolution for every patch.
#pragma once
#include <tbb/enumerable_thread_specific.h>

#include <map>
#include <memory>
#include <vector>

#include "allocate/distortion.h"
#include "code/stream.h"
#include "coefficients.h"
#include "resample/cliffs.h"
#include "resample/elevation_map.h"

namespace relief {

// A patch sampled at one resolution: a point of its rate-distortion curve for every step.
struct Candidate {
  ElevationMap map;  // cropped to its mask
  WaveletImage image;
  Distortion distortion;
  uint32_t boundary_nodes = 0;
  bool empty() const { return map.pixels == 0; }
};

struct AllocationInput {
  const Surface& surface;
  const Ownership& ownership;
  const std::vector<PatchFaces>& patches;
  const std::vector<float>& from_border;  // of each face, see extend_border
  DistanceToSurface distance;
  double spacing;  // of resolution index 0; index k has spacing * 2^(-k/4)
  bool fit;
};

// Chooses for a Lagrangian parameter, and keeps every candidate it ever made.
class Allocator {
 public:
  explicit Allocator(const AllocationInput& input);

  struct Choice {
    std::vector<int> resolution;  // index for each patch; kDropped: the patch has no pixels
    double step;                  // of resolution index 0, of a scalar quantiser
  };
  static constexpr int kDropped = -1;

  // The resolution of each patch that minimises D + lambda R, for steps that go with lambda.
  // lambda: squared distance times area a bit, lattice units^4.
  Choice choose(double lambda);

  // The same resolution for the whole model: mu times the mean vertex spacing of each patch (3.4).
  Choice fixed(double lambda, double mu);

  std::vector<CodedPatch> coded(const Choice& choice, double& spacing, double& step,
                                std::vector<int>& patch_number);

 private:
  struct LastSampler {
    size_t patch;
    std::unique_ptr<PatchSampler> sampler;
  };

  const PatchSampler& sampler_of(size_t patch);
  const Candidate& candidate(size_t patch, int resolution);
  double cost(size_t patch, int resolution, double lambda);
  void train(double lambda);
  int coarsest_resolution() const;
  void keep_one(Choice& choice);
  template <class Visit>
  void for_each_patch(Visit visit) const;

  AllocationInput in_;
  std::vector<std::map<int, std::unique_ptr<Candidate>>> made_;
  tbb::enumerable_thread_specific<LastSampler> samplers_;
  std::vector<int> start_;                     // where each patch's search begins: its last choice
  std::vector<char> must_live_;                // patches of components that would vanish with them
  std::unique_ptr<CoefficientModels> models_;  // trained on the first choice
};

// The format's range of a step.
constexpr double kLeastStep = 1.0 / 32, kMostStep = 1 << 19;

// RDOQ's exchange rate: squared steps a bit, of the scalar quantiser that allocation counts with. With it,
// lambda = kTrade * (step * spacing)^2.
constexpr double kTrade = 0.11;

}  // namespace relief
