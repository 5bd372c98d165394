// Pixels that the masks are better without: the encoder finds them by decoding.
#pragma once
#include "seams/folds.h"
#include "seams/gap_error.h"

namespace relief {

struct MaskFaults {
  int coincident = 0;  // pixels at another one's point
  double lost = 0;     // what leaving pieces away costs, squared distance times area; summed up
};

// Vertices that are pixels.
struct UnwantedPixels {
  // - small pieces that no link could join to the rest of their component;
  // - small pieces that are joined to it through the air, at much more error than leaving them away;
  // - one of two pixels at one point of the lattice.
  std::vector<uint32_t> needful;
  // Others, where it may be better without:
  // - pixels where links contradict one another;
  // - pixels beyond the border of another patch, where the triangles between the patches turn over.
  std::vector<uint32_t> wished;
};
UnwantedPixels unwanted_pixels(const DecodedMesh& decoded, const Ground& ground, const Pieces& pieces,
                               const GapError& error, const std::vector<Fold>& folds, MaskFaults& faults);

}  // namespace relief
