// Where the handles of a surface are.
#pragma once
#include <vector>

#include "surface/surface.h"

namespace relief {

struct HandlePlace {
  Vec3 middle;    // lattice units
  double radius;  // of the ball about it, along the surface, that has a handle; or the largest that was tried
};

// One for each handle of the surface, the smallest first. They are where a tree of vertices and a tree of
// faces leave edges over, two a handle (tree and cotree, Eppstein 2003), for trees that make the loops
// through these edges the shortest (Erickson and Whittlesey 2005).
std::vector<HandlePlace> handle_places(const Surface& surface);

}  // namespace relief
