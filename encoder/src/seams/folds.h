// Where triangles between patches turn over, and the surface does not.
#pragma once
#include <unordered_map>
#include <unordered_set>

#include "seams/links.h"

namespace relief {

// Vertices where the surface itself is folded.
std::vector<Vec3> folded_vertices(const Surface& surface);

// Two neighbouring triangles, one at least between patches, that are flipped (measure/topology.h).
struct Fold {
  std::array<uint32_t, 2> triangle;  // of the mesh
  std::array<uint32_t, 2> end;       // of their edge: vertices
};

class FoldFinder {
 public:
  // decoded: of these patches, with any seams; folded: of the surface
  FoldFinder(const DecodedMesh& decoded, const Ground& ground, const std::vector<Vec3>& folded);
  std::vector<Fold> find(const DecodedMesh& decoded) const;

 private:
  bool in_surface(const Vec3& p) const;
  void add_surface_fold(const Vec3& p);

  const Ground& ground_;
  double cell_ = 1;                                // of a grid
  std::unordered_set<uint64_t> surface_;           // cells around edges where the surface itself is folded
  std::unordered_map<uint64_t, uint32_t> border_;  // edge between border pixels -> the patch's triangle
};

Vec3 unit_normal(const DecodedMesh& decoded, const Ground& ground, size_t triangle);

}  // namespace relief
