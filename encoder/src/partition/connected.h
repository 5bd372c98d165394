// Connectivity of patches.
#pragma once
#include "partition/normal_cone.h"

namespace relief {

// A connected part of a patch.
struct Piece {
  int patch;
  double area = 0;
  std::vector<int> faces;
};
// All of them, in the order of their first faces; faces of label -1 are in none.
std::vector<Piece> pieces_of(const Surface& surface, const std::vector<int>& label);

// Makes every patch edge-connected. Of a patch in several pieces the largest keeps the number; the others go
// to the neighbour with the longest common border among those whose cone (of cosine `epsilon`) admits them,
// or else become patches. Returns the number of pieces that moved.
int connect_patches(const NormalCone& cone, const Surface& surface, Patches& patches, double epsilon);

}  // namespace relief
