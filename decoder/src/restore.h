// Restoration of elevations after the wavelet: quantisation leaves a patch rougher than it was.
//
// Each pixel moves towards what its neighbours along its row and along its column foretell, each way by no
// more than a share of the step: noise of quantisation is of that size, and what is larger is the surface's.
// With two neighbours on both sides that is the cubic through them; without the second one on one side, half
// of the way to the parabola through the other three, and twice as far at most; at the mask's edge the
// parabola through the three inwards. With fewer it does not move.
#pragma once
#include "format.h"
#include "leaves.h"

namespace relief {

// The most that a pixel moves along one line, in steps of the patch. Fitted on scans; part of the format.
constexpr float kRestoreLimit = 0.11f;

// z: elevations of the patch, row by row, with kMargin floats before and kMargin + kBlock behind.
// mask: of low[0]. out: as many floats and kBlock behind, apart from z.
void restore(const Pyramid& p, const uint8_t* mask, const float* z, float step, float* out,
             const Leaves& leaves = best_leaves());

}  // namespace relief
