// Merging of neighbouring patches (paper, 3.3).
#pragma once
#include <functional>

#include "partition/normal_cone.h"

namespace relief {

// Tells whether these faces may be one patch over the plane with this normal; called after the cone has been
// tested.
using MayMerge = std::function<bool(const std::vector<int>& faces, const Vec3& normal)>;

// Merges neighbours, those with the longest common border first, while the union satisfies the normal-cone
// condition. Returns the number of merges. `may_merge` may be empty; it may be called from several threads at
// once.
int merge_patches(const NormalCone& cone, const Surface& surface, Patches& patches,
                  const MayMerge& may_merge);

// Merges neighbours, those first that raise the cost (4) of the partition least (3.3, a priority queue),
// while the union satisfies the normal-cone condition.
void merge_cheapest(const NormalCone& cone, const Surface& surface, Patches& patches);

}  // namespace relief
