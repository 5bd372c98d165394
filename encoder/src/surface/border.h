// Where the surface ends: its boundary loops, and how far its faces are from them.
#pragma once
#include "surface/surface.h"

namespace relief {

struct SurfaceBorder {
  struct Loop {
    Vec3 middle = Vec3::Zero();  // of its vertices
    double radius = 0;           // of the ball around the middle that holds them
    int face = -1;               // one at the loop
  };
  std::vector<Loop> loops;
  // Of each face; empty where the surface is closed.
  std::vector<float> distance;  // to the nearest loop, from face to face; INFINITY beyond the reach
  std::vector<int> loop;        // that loop; -1 beyond the reach
};

// Loops of a smaller radius are taken for closed.
SurfaceBorder border_of(const Surface& surface, double reach, double least_radius = 0);

}  // namespace relief
