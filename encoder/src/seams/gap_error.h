// What the triangles between patches cost: their distance from the surface, and what of it they leave bare.
#pragma once
#include <array>
#include <unordered_map>
#include <vector>

#include "resample/cliffs.h"
#include "seams/links.h"

namespace relief {

// Distances from the surface, or mean squared ones, by the keys of triangles, so that none is measured twice.
using KnownTriangles = std::unordered_map<uint64_t, float>;

// A face is looked at if it has more than this share of all error.
constexpr double kShareOfError = 0.003;

struct GapError {
  std::vector<uint64_t> key;                // of each triangle between patches; tells it from others
  std::vector<std::array<Vec3, 3>> corner;  // lattice
  std::vector<double> area;
  std::vector<float> squared;   // mean squared distance from the surface
  std::vector<double> of_face;  // squared distance times area, of each face
  double sum = 0;
};
GapError gap_error(const DecodedMesh& decoded, const Ground& ground, const DistanceToSurface& distance,
                   double spacing, KnownTriangles& known);

// Distances from the surface of the middles of the triangles between patches; `known` as above, but of these.
std::vector<float> distances_of_middles(const DecodedMesh& decoded, const Ground& ground,
                                        const DistanceToSurface& distance, KnownTriangles& known);

// Squared distance times area of what lay along the surface before and is far from all triangles between
// patches after.
double laid_bare(const GapError& before, const GapError& after);

}  // namespace relief
