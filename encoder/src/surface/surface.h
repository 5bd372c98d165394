// The encoder's view of a surface: an oriented 2-manifold triangle mesh, with or without border.
#pragma once
#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "relief/encoder.h"

namespace relief {

using Vec3 = Eigen::Vector3d;

// Coordinates are in lattice units: the diagonal of the input's bounding box is kLatticeDiagonal long and the
// centre of the box is the origin, so an error E (1e-4 of the diagonal) is E * 104.8576 units. model = origin
// + scale * lattice.
constexpr double kLatticeDiagonal = 1 << 20;

struct Surface {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>>
      faces;  // counter-clockwise from outside; never degenerate (three distinct vertices)
  std::vector<std::array<int, 3>>
      adjacent;                // the face across the edge (v[k], v[(k+1)%3]), or -1 at the border
  std::vector<Vec3> normals;   // unit, one a face; (0,0,0) for a face without area
  std::vector<double> areas;   // one a face
  std::vector<int> component;  // connected component (by edges) of each face, numbered from 0
  std::vector<double> component_area;
  // Of point clouds, else empty: how high the surface lies over the middle of each edge, along the normal
  // there; see points/point_surface.h.
  std::vector<std::array<float, 3>> bulge;
  std::vector<int> source;  // the triangle of the input that each face came from
  double total_area = 0;
  Vec3 origin = Vec3::Zero();
  double scale = 1;
  std::vector<std::string> warnings;  // what was repaired, a line each
};

inline Vec3 middle_of(const Surface& s, int face) {
  const auto& v = s.faces[size_t(face)];
  return (s.vertices[size_t(v[0])] + s.vertices[size_t(v[1])] + s.vertices[size_t(v[2])]) / 3;
}

// Merges vertices of equal position, drops degenerate and duplicate triangles, makes neighbours agree in
// orientation where they can, and splits non-manifold edges and vertices (3.2 needs a surface on which
// flooding is well defined). Throws InputError if no triangle with positive area is left.
Surface build_surface(const TriangleMesh& mesh);

}  // namespace relief
