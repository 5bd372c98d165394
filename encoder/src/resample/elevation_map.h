// Resampling of a patch on a regular grid (3.4).
#pragma once
#include <vector>

#include "format.h"
#include "partition/partition.h"
#include "resample/ownership.h"
#include "surface/border.h"

namespace relief {

// A patch of the partition, ready to be sampled at any spacing.
struct PatchFaces {
  std::vector<int> own;   // faces with the patch's label
  std::vector<int> ring;  // faces of other labels around it that face its plane
  int32_t u = 0, v = 0;   // the plane's normal as the stream holds it
  Frame frame;
  std::vector<SurfaceBorder::Loop> loops;  // of the surface's border in it, that its masks must show
};

// The elevation map of a patch: pixel (x, y) lies at ((x0 + x) e1 + (y0 + y) e2 + z0 n) * spacing + z n.
struct ElevationMap {
  uint32_t width = 0, height = 0;
  int32_t x0 = 0, y0 = 0, z0 = 0;
  double spacing = 0;
  std::vector<uint8_t> mask;  // 0 or 1
  std::vector<float> z;       // lattice units; read inside of the mask only
  std::vector<int> face;      // of the surface, that each pixel lies over; -1: none
  size_t pixels = 0;          // of the mask
};

// The surface over a patch's plane on a grid that is kOversampling times finer than the map's.
constexpr int kOversampling = 4;
struct FineRaster {
  uint32_t width = 0, height = 0;  // (map.width - 1) * kOversampling + 1, likewise
  std::vector<float> z;            // elevation without z0; NaN: no surface
  std::vector<uint8_t> owner;      // 0: none, 1: the patch, 2: another patch
  std::vector<int> face;           // of the map's pixels only; -1: none
};

std::vector<PatchFaces> gather_patches(const Surface& surface, const Partition& partition, double reach);

// A face of a patch or around it, laid into the patch's frame: lattice units.
struct ProjectedFace {
  static constexpr uint8_t kMixed = 3;
  double x[3], y[3], z[3];
  int face;
  uint8_t owner;  // of all of it, see FineRaster; kMixed: several have a part
};

// Samples a patch at any spacing. Refers to what it was made of.
class PatchSampler {
 public:
  PatchSampler(const Surface& surface, const Ownership& ownership, const std::vector<PatchFaces>& patches,
               size_t index);

  // The mask is not cleaned yet; it is empty if no pixel of the grid belongs to the patch.
  ElevationMap sample(double spacing, FineRaster& fine) const;

 private:
  void project(const std::vector<int>& faces);
  void find_bounds();
  ElevationMap place_grid(double spacing) const;

  const Surface& surface_;
  const Ownership& ownership_;
  const std::vector<PatchFaces>& patches_;
  const size_t index_;
  std::vector<ProjectedFace> faces_;
  double lo_[2], hi_[2], height_ = 0;  // bounds over the plane, mean height over it
};

}  // namespace relief
