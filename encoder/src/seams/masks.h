// Pixels that the masks are better without: the encoder finds them by decoding.
#pragma once
#include <list>

#include "seams/gap_error.h"

namespace relief {

// A patch's mask and image without some pixels.
struct CleanedPatch {
  std::vector<uint8_t> mask;
  WaveletImage image;
};

// What unwanted_pixels finds.
struct MaskFaults {
  int folds = 0;       // edges where triangles turn over that the surface does not have there
  int coincident = 0;  // pixels at another one's point
  double lost = 0;     // what leaving pieces away costs, squared distance times area; summed up
};

// For every vertex that is a pixel, whether its mask is better without it:
// - small pieces that no link could join to the rest of their component;
// - small pieces that are joined to it through the air, at much more error than leaving them away;
// - one of two pixels at one point of the lattice;
// - pixels where links contradict one another;
// - pixels beyond the border of another patch, where the triangles between the patches turn over.
// needful: only the first three.
std::vector<char> unwanted_pixels(const DecodedMesh& decoded, const Ground& ground, const Pieces& pieces,
                                  const GapError& error, bool needful, MaskFaults& faults);

// Takes the pixels out. Patches that lose every pixel are taken out, from patch_number as well. `storage`
// keeps what `patches` then points to. Returns whether anything was changed.
bool remove_pixels(const std::vector<char>& unwanted, std::vector<CodedPatch>& patches,
                   std::vector<int>& patch_number, std::list<CleanedPatch>& storage);

}  // namespace relief
