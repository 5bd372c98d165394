// Small pieces of masks that find no partner: the decoder would close each to a speck of its own.
#pragma once
#include <list>

#include "seams.h"

namespace relief {

// A patch's mask and image without its specks.
struct CleanedPatch {
  std::vector<uint8_t> mask;
  WaveletImage image;
};

// Takes the pixels out of the masks that decode to components beyond the `wanted` largest, if those are small. Patches
// that lose every pixel are taken out, from patch_number as well. `storage` keeps what `patches` then points to.
// Returns whether anything was changed.
bool remove_specks(const DecodedMesh& decoded, size_t wanted, std::vector<CodedPatch>& patches,
                   std::vector<int>& patch_number, std::list<CleanedPatch>& storage);

}  // namespace relief
