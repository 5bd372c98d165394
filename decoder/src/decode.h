// The decoder with a view inside, for the encoder.
#pragma once
#include "gaps.h"
#include "relief/relief.h"

namespace relief {

// relief_decode that also notes where the triangles of each face between the patches begin (trace may be
// null).
relief_status decode_traced(const void* data, size_t size, const relief_limits* limits, relief_mesh* mesh,
                            void* workspace, size_t workspace_size, GapTrace* trace);

}  // namespace relief
