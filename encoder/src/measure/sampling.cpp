#include "measure/sampling.h"

#include <Eigen/Geometry>
#include <cmath>

#include "relief/encoder.h"

namespace relief {
namespace {

// Steele, Lea and Flood's SplitMix64 of a counter, as a number in [0, 1).
double hash_to_unit(uint64_t i) {
  uint64_t z = (i + 1) * 0x9e3779b97f4a7c15ull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return double((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

double fraction(double x) { return x - std::floor(x); }

}  // namespace

std::vector<SurfaceSample> sample_surface(const std::vector<Eigen::Vector3d>& positions,
                                          const std::vector<std::array<uint32_t, 3>>& triangles, size_t count,
                                          const std::vector<double>& weight, uint64_t set) {
  std::vector<double> cumulated(triangles.size());
  double total = 0;
  auto weight_of = [&](size_t t) { return weight.empty() ? 1 : weight[t]; };
  for (size_t t = 0; t < triangles.size(); t++) {
    const auto& [a, b, c] = triangles[t];
    total += (positions[b] - positions[a]).cross(positions[c] - positions[a]).norm() / 2 * weight_of(t);
    cumulated[t] = total;
  }
  if (!(total > 0)) throw InputError("has no triangle of positive area");

  // Roberts' R2 sequence: steps by powers of the inverse of the plastic number.
  constexpr double kStep1 = 0.7548776662466927, kStep2 = 0.5698402909980532;
  const double start = 0.5 + 0.31 * double(set);
  std::vector<SurfaceSample> samples(count);
  size_t t = 0;
  for (size_t i = 0; i < count; i++) {
    double place = (double(i) + hash_to_unit(i + set * count)) / double(count) * total;
    while (t + 1 < triangles.size() && cumulated[t] <= place) t++;
    const auto& [a, b, c] = triangles[t];
    double u = fraction(start + double(i) * kStep1), w = fraction(start + double(i) * kStep2);
    if (u + w > 1) u = 1 - u, w = 1 - w;  // fold the unit square onto the triangle
    samples[i] = {positions[a] * (1 - u - w) + positions[b] * u + positions[c] * w, uint32_t(t),
                  total / double(count) / weight_of(t)};
  }
  return samples;
}

}  // namespace relief
