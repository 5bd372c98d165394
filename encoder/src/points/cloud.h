// A point cloud on its way to a surface (paper, section 3: the finite set P).
#pragma once
#include "points/kd_tree.h"

namespace relief {

// A cloud in the units of its model, all lists of one length.
struct Cloud {
  std::vector<Vec3> points;
  std::vector<Vec3> normals;  // unit, consistently oriented; those of the file or estimated
  std::vector<double>
      spacing;  // mean distance of points around each one: the area that one takes is its square
};

// Points of the nearest so many that tell about a place: of spacing, planes and graphs.
constexpr size_t kNeighbours = 12;

// The spacing at each point: kNeighbours points lie in the disc that reaches the last of them. Smoothed over
// the neighbours, since clusters and pairs say little about what lies between them.
std::vector<double> spacings(const KdTree& tree);

// Which points are outliers: those whose neighbours are far away, against what those neighbours have
// themselves; for instance specks in the air around a scan.
std::vector<char> outliers(const KdTree& tree);

// Removes all points i with drop[i].
template <class T>
void remove_marked(std::vector<T>& list, const std::vector<char>& drop) {
  size_t n = 0;
  for (size_t i = 0; i < list.size(); i++)
    if (!drop[i]) list[n++] = list[i];
  list.resize(n);
}

}  // namespace relief
