// Steiner points in the gaps: where the surface bulges between patches.
#pragma once
#include "seams/attempt.h"

namespace relief {

// Splits edges between triangles of gaps and lifts their middles to the surface, wherever that lessens the
// error by more than its bytes would elsewhere.
void add_steiner_points(const SeamContext& in, Attempt& best);

}  // namespace relief
