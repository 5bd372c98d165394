#include "points/cloud.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace relief {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLonely = 3;  // times the reach of the neighbours

// The distance of the last of kNeighbours neighbours, and of all of them the index.
struct Reach {
  std::vector<double> radius;
  std::vector<uint32_t> neighbour;  // kNeighbours a point; the point itself where there are fewer
};

Reach reach_of(const KdTree& tree) {
  const size_t count = tree.points().size();
  Reach reach{std::vector<double>(count), std::vector<uint32_t>(count * kNeighbours)};
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, 256), [&](const auto& range) {
    std::vector<Neighbour> near;
    for (size_t i = range.begin(); i < range.end(); i++) {
      tree.nearest(tree.points()[i], kNeighbours + 1, near);  // with the point itself
      reach.radius[i] = std::sqrt(near.back().squared);
      for (size_t k = 0; k < kNeighbours; k++)
        reach.neighbour[i * kNeighbours + k] = k + 1 < near.size() ? near[k + 1].index : uint32_t(i);
    }
  });
  return reach;
}

// The middle one of the neighbours' values.
double median_around(const Reach& reach, size_t i) {
  double v[kNeighbours];
  for (size_t k = 0; k < kNeighbours; k++) v[k] = reach.radius[reach.neighbour[i * kNeighbours + k]];
  std::nth_element(v, v + kNeighbours / 2, v + kNeighbours);
  return v[kNeighbours / 2];
}

}  // namespace

std::vector<double> spacings(const KdTree& tree) {
  const Reach reach = reach_of(tree);
  std::vector<double> spacing(reach.radius.size());
  const double per_radius = std::sqrt(kPi / double(kNeighbours));
  tbb::parallel_for(size_t(0), spacing.size(), [&](size_t i) {
    spacing[i] = per_radius * std::max(median_around(reach, i), 0.5 * reach.radius[i]);
  });
  return spacing;
}

std::vector<char> outliers(const KdTree& tree) {
  const Reach reach = reach_of(tree);
  std::vector<char> out(reach.radius.size());
  tbb::parallel_for(size_t(0), out.size(),
                    [&](size_t i) { out[i] = reach.radius[i] > kLonely * median_around(reach, i); });
  return out;
}

}  // namespace relief
