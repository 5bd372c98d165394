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

// Samples a patch. The mask is not cleaned yet; it is empty if no pixel of the grid belongs to the patch.
ElevationMap sample_patch(const Surface& surface, const Ownership& ownership,
                          const std::vector<PatchFaces>& patches, int index, double spacing,
                          FineRaster& fine);

}  // namespace relief
