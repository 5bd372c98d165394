// Handles of the surface that are smaller than the grid, as tubes; see decoder/src/tube.cpp.
#pragma once
#include "seams/attempt.h"

namespace relief {

// Adds as many tubes as handles are missing, where the surface's smallest ones are. To be called last: the
// result's triangles are no longer what the other steps take them for.
void add_tubes(const SeamContext& in, Attempt& best);

}  // namespace relief
