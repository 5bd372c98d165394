// Generalised Lloyd's algorithm on a surface (paper, 3.3).
#pragma once
#include <functional>

#include "partition/normal_cone.h"

namespace relief {

// Floods the surface from seeds and refits the planes, adding seeds where a patch leaves its cone, until
// every patch satisfies the normal-cone condition. Patches are edge-connected.
Patches generalized_lloyd(const NormalCone& cone, const std::function<void(double)>& progress);

}  // namespace relief
