// The decoder with a view inside, for the encoder.
#pragma once
#include "gaps.h"
#include "relief/relief.h"

namespace relief {

// relief_decode or relief_decode_smoothed, which also fills in the trace (may be null).
relief_status decode_traced(const void* data, size_t size, const relief_limits* limits, relief_mesh* mesh,
                            void* workspace, size_t workspace_size, bool smooth, GapTrace* trace);

}  // namespace relief
