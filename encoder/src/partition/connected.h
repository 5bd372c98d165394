// Connectivity of patches.
#pragma once
#include "partition/normal_cone.h"

namespace relief {

// Makes every patch edge-connected. Of a patch in several pieces the largest keeps the number; the others go
// to the neighbour with the longest common border among those whose cone (of cosine `epsilon`) admits them,
// or else become patches. Returns the number of pieces that moved.
int connect_patches(const NormalCone& cone, const Surface& surface, Patches& patches, double epsilon);

}  // namespace relief
