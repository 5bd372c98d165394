// The surface's handles, which the decoder makes only where the stream says so.
#pragma once
#include "seams/attempt.h"

namespace relief {

// Lets links make handles as long as that brings the genus nearer to the surface's.
void add_handles(const SeamContext& in, Attempt& best);

}  // namespace relief
