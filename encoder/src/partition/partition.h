// Partition of a surface into patches that are height fields over planes (paper, 3.2 and 3.3).
#pragma once
#include <functional>
#include <vector>

#include "relief/encoder.h"
#include "surface/surface.h"

namespace relief {

struct PartitionOptions {
  double aperture = 80;  // degrees
  Clustering clustering = Clustering::kLloyd;
  Plane plane = Plane::kAverage;
  double spacing =
      0;  // grid spacing, lattice units, at which no patch may cover a pixel twice; 0: mean vertex spacing
  std::function<void(double)> progress;  // 0 to 1; may be empty
};

struct Partition {
  std::vector<int> label;    // patch of each face, 0 .. normal.size()-1; -1: in no patch
  std::vector<Vec3> normal;  // of each patch's plane, unit length
};

// Clustering as asked until every patch is a height field within the aperture, then boundary shape
// optimisation, which may reach 4 degrees beyond the aperture (up to 88). Every face with area belongs to a
// patch; every patch is edge-connected; no patch covers a pixel of the given spacing twice, folded areas of
// less than 2e-5 of the surface excepted. Planes are the area-weighted averages of their faces' normals, or
// as asked the axes of the smallest cones around them, where the patch is a height field over that plane,
// too. Deterministic: the same on any number of threads.
Partition partition_surface(const Surface& surface, const PartitionOptions& options);

// J(R) of equation (4), over the area of the surface: the mean squared distance of normals to their planes'.
// 0 to 4.
double partition_cost(const Surface& surface, const Partition& partition);

// What a coded surface missed.
struct Missed {
  const std::vector<float>& distance;  // from the middle of each face to the coded surface, lattice units
  double far;                          // a region is missed where it is farther away than this
  double worth;  // squared distance times area that a region must have to become patches of its own
};

// Makes connected regions that were missed patches of their own: pits and tunnels narrower than a few faces,
// and sheets that their patch lays one over the other; the condition of the cone is then taken face by face.
// Returns whether there were any.
bool split_missed(const Surface& surface, const PartitionOptions& options, const Missed& missed,
                  Partition& partition);

}  // namespace relief
