// Steiner points in the gaps: where the surface bulges between patches.
#pragma once
#include "seams/attempt.h"

namespace relief {

struct SteinerError {
  double error = 0;       // lattice units; 0: there are no gaps
  bool measured = false;  // else it is foretold, within a few tenths of a percent
};

// Splits edges between triangles of gaps and lifts their middles to the surface, wherever that lessens the
// error by more than its bytes would elsewhere; or as often as just keeps within the input's target, if that
// is near. Returns the error that this leaves. exactly: near the target it is measured, and they are chosen
// again if it is not what was foretold.
SteinerError add_steiner_points(const SeamContext& in, Attempt& best, bool exactly);

}  // namespace relief
