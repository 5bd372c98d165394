// Smoothing of patch boundaries by diffusion of labels.
#pragma once
#include "partition/normal_cone.h"

namespace relief {

// Moves the boundaries as by mean curvature (Merriman, Bence, Osher: diffuse every patch's indicator for some
// steps, then give each face to the strongest), which straightens them over many faces, where reassigning
// single triangles stops at the first local minimum. A face only moves to a patch whose cone (of cosine
// `epsilon`) admits it. Patches may fall apart; the planes are refitted.
void diffuse_labels(const NormalCone& cone, const Surface& surface, Patches& patches, double epsilon,
                    int rounds, int steps);

}  // namespace relief
