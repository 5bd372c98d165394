// Boundary shape optimisation (paper, 3.3).
#pragma once
#include "partition/normal_cone.h"

namespace relief {

// Reassigns single triangles and connected pairs to an adjacent patch as long as that shortens the
// boundaries, largest decrease first. A reassigned face lies within the new patch's cone (of cosine
// `epsilon`), and no patch falls apart. The planes are refitted at the end. Returns the decrease in length.
double optimize_boundary_shape(const NormalCone& cone, const Surface& surface, Patches& patches,
                               double epsilon);

}  // namespace relief
