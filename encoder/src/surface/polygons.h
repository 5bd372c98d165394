// What the readers share: polygons into triangles, checks with the number of the face or vertex to blame.
#pragma once
#include <cmath>
#include <string>

#include "relief/encoder.h"

namespace relief {

// Collects the corners of one polygon after another and appends their fans. Faces of one or two corners have
// no area and are left out.
class PolygonFan {
 public:
  PolygonFan(TriangleMesh& mesh, size_t vertex_count) : mesh_(mesh), vertex_count_(vertex_count) {}

  void begin_face() { corners_ = 0, face_++; }

  void corner(int64_t index) {
    if (index < 0 || uint64_t(index) >= vertex_count_)
      throw InputError("face " + std::to_string(face_ - 1) + ": vertex index " + std::to_string(index) +
                       " is out of range (" + std::to_string(vertex_count_) + " vertices)");
    uint32_t i = uint32_t(index);
    if (corners_ == 0) first_ = i;
    if (corners_ >= 2) mesh_.triangles.push_back({first_, last_, i});
    last_ = i;
    corners_++;
  }

 private:
  TriangleMesh& mesh_;
  size_t vertex_count_, face_ = 0, corners_ = 0;
  uint32_t first_ = 0, last_ = 0;
};

// Called by read_mesh for every format. points: there need be no faces.
inline void check_mesh(const TriangleMesh& mesh) {
  if (mesh.positions.empty()) throw InputError("has no vertices");
  for (size_t i = 0; i < mesh.positions.size(); i++)
    for (float c : mesh.positions[i])
      if (!std::isfinite(c))
        throw InputError("vertex " + std::to_string(i) + " has a coordinate that is " +
                         (std::isnan(c) ? "not a number" : "infinite"));
}

}  // namespace relief
