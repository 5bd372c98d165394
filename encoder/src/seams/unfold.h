// Leaves out links between patches where that unfolds triangles: their faces become one, which may be closed
// without a fold.
#pragma once
#include "seams/attempt.h"

namespace relief {

// Takes links out of the attempt as long as triangles turn over between patches, no more of the surface is
// missed, and its topology is no farther off.
void unfold(const SeamContext& in, Attempt& best);

}  // namespace relief
