// Split-merge clustering (paper, 3.3).
#pragma once
#include "partition/normal_cone.h"

namespace relief {

// Splits the surface by principal component analysis until the smallest cone around each cluster's normals
// has an aperture of at most `alpha` degrees, or half of that of `cone`: so narrow that the average normal,
// too, has all of them within the latter. Then merges neighbours, those first that raise the cost (4) least,
// while the union satisfies the normal-cone condition of `cone`, whose aperture is the paper's beta. Patches
// are edge-connected. Components without area get no patch.
Patches split_merge(const NormalCone& cone, const Surface& surface, double alpha);

}  // namespace relief
