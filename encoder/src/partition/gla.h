// Generalised Lloyd's algorithm on a surface (paper, 3.3).
#pragma once
#include <functional>

#include "partition/normal_cone.h"

namespace relief {

// Floods the surface from seeds and refits the planes, adding seeds where a patch leaves its cone, until
// every patch satisfies the normal-cone condition; first on cells of several faces, which is as many times
// faster, then on faces. Patches are edge-connected. Components without area get no patch.
Patches generalized_lloyd(const NormalCone& cone, const Surface& surface,
                          const std::function<void(double)>& progress);

}  // namespace relief
