// Patches under construction: labels and planes, and the bookkeeping that all steps of the partition share.
#pragma once
#include <array>
#include <vector>

#include "surface/surface.h"

namespace relief {

struct Patches {
  std::vector<int> label;    // patch of each face; -1: in no patch (a component without area)
  std::vector<Vec3> normal;  // unit normal of each patch's plane
};

// The faces of every patch, in ascending order, in one array: those of patch p are face[first[p]] ..
// face[first[p+1]-1].
struct FaceLists {
  std::vector<int> first, face;
  const int* begin(int p) const { return face.data() + first[p]; }
  const int* end(int p) const { return face.data() + first[p + 1]; }
  int size(int p) const { return first[p + 1] - first[p]; }
};
FaceLists faces_by_patch(const std::vector<int>& label, size_t patches);

// The common border of two patches a < b.
struct Border {
  int a, b;
  double length;
};
std::vector<Border> borders(const Surface& surface, const std::vector<int>& label);  // sorted by (a, b)

double edge_length(const Surface& surface, int face, int k);

// Length of all edges between faces of different patches; the surface's own border does not count.
double boundary_length(const Surface& surface, const std::vector<int>& label);

// Sets every plane's normal to the area-weighted average of its faces' normals (3.3, centroid fitting). A
// patch whose normals cancel out keeps the normal it has.
void refit(const Surface& surface, Patches& patches);

// Removes patches without faces and numbers the others anew, in the order of their numbers.
void compact(Patches& patches);

}  // namespace relief
