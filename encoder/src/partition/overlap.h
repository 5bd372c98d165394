// Patches that cover a pixel twice.
#pragma once
#include "partition/normal_cone.h"

namespace relief {

// Where a patch lies over itself at two heights more than three pixels apart.
struct Overlap {
  int pixels = 0;           // that are covered twice
  int low = -1, high = -1;  // the two faces farthest apart over one pixel
};

// Rasters the faces that face the plane with this normal, on a grid of this spacing.
Overlap find_overlap(const Surface& surface, const int* begin, const int* end, const Vec3& normal,
                     double spacing);

// True if so few pixels are covered twice that the patch counts as a height field.
inline bool is_height_field(const Overlap& overlap) { return overlap.pixels <= 5; }

// Splits every patch that is not a height field between the two faces farthest apart, again and again until
// it is one. Normal cones get no wider by more than the change of the planes. Returns the number of splits.
int split_overlaps(const Surface& surface, Patches& patches, double spacing);

}  // namespace relief
