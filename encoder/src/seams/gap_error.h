// What the triangles between patches cost: their distance from the surface, and what of it they leave bare.
#pragma once
#include <array>
#include <unordered_map>
#include <vector>

#include "resample/cliffs.h"
#include "seams/links.h"

namespace relief {

// A triangle between patches.
struct GapTriangle {
  uint64_t key;   // tells it from others
  double area;    // lattice units^2
  float squared;  // mean squared distance from the surface
  float middle;   // the distance of its middle
};

// By their keys, so that none is measured twice.
using KnownTriangles = std::unordered_map<uint64_t, GapTriangle>;

// A face is looked at if it has more than this share of all error.
constexpr double kShareOfError = 0.003;

struct GapError {
  std::vector<GapTriangle> triangle;  // in the order of the mesh
  std::vector<double> of_face;        // squared distance times area, of each face
  double sum = 0;
};
// like: of a mesh that is much the same; only saves time.
GapError gap_error(const DecodedMesh& decoded, const Ground& ground, const DistanceToSurface& distance,
                   double spacing, const GapError& like, KnownTriangles& known);

// Squared distance times area of what lay along the surface before and is far from all triangles between
// patches after.
double laid_bare(const DecodedMesh& before, const GapError& error_before, const DecodedMesh& after,
                 const GapError& error_after, const Ground& ground);

}  // namespace relief
