// The borders of what a stream decodes to, from trial to trial of seams: only the triangles between patches
// change.
#pragma once
#include "seams/decoded.h"

namespace relief {

class Borders {
 public:
  struct Count {
    uint64_t edges = 0;  // of one triangle
    uint64_t loops = 0;  // closed chains of those
  };

  Borders() = default;
  explicit Borders(const DecodedMesh& decoded);  // of these patches, with any seams
  Count count(const DecodedMesh& decoded) const;

 private:
  // What the edges opposite of a vertex add up to, over its triangles: end minus start, of their vertices and
  // of the squares of those. On a manifold the edges make a ring around the vertex, both sums are zero, or a
  // chain, whose ends they tell.
  struct Sums {
    int64_t first = 0, second = 0;
  };
  static void add(const DecodedMesh& decoded, size_t begin, size_t end, std::vector<Sums>& sums);

  std::vector<Sums> patches_;  // of their triangles alone
};

}  // namespace relief
