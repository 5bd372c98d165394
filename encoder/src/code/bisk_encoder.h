// The encoder's side of decoder/src/bisk.h: embedded coding and allocation of the bits to patches (3.6).
#pragma once
#include <cstdint>
#include <vector>

#include "code/stream.h"

namespace relief {

struct EmbeddedCode {
  std::vector<uint8_t> bytes;
  size_t at_trade = 0;  // how many of them hold all that gains as much as the placement's trade asks for
};

// The step of the finest bit plane, and so of the stream, for a step that quantisation would take.
float finest_bisk_step(float step);

// All bit planes of the patches, down to the step of the placement, in the order of its allocation: every
// prefix is a coarser version of the whole.
EmbeddedCode code_bisk(const std::vector<CodedPatch>& patches, const StreamPlacement& placement);

}  // namespace relief
