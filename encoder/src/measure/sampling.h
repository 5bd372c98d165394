// Points spread over a surface.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace relief {

struct SurfaceSample {
  Eigen::Vector3d point;
  uint32_t triangle;
  double area;  // that it stands for; all together: the surface's
};

// `count` stratified samples, in the order of the triangles: the area, laid out triangle after triangle, is
// cut into `count` equal strata with one sample at a pseudo-random place in each; within its triangle a
// sample is placed by a low-discrepancy sequence. Always the same for the same mesh. Throws InputError if
// there is no area.
//   set     other numbers make other samples
//   weight  of each triangle, positive: so many times more samples by area; empty: all 1
std::vector<SurfaceSample> sample_surface(const std::vector<Eigen::Vector3d>& positions,
                                          const std::vector<std::array<uint32_t, 3>>& triangles, size_t count,
                                          const std::vector<double>& weight = {}, uint64_t set = 0);

}  // namespace relief
