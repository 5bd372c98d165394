// Neighbourhoods of points, by nanoflann's k-d tree.
#pragma once
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "surface/surface.h"

namespace relief {

struct Neighbour {
  uint32_t index;
  double squared;  // distance
};

class KdTree {
 public:
  explicit KdTree(const std::vector<Vec3>& points);  // keeps a reference
  KdTree(KdTree&&) noexcept;
  ~KdTree();

  // The `count` points nearest to p, or all if there are fewer; nearest first.
  void nearest(const Vec3& p, size_t count, std::vector<Neighbour>& out) const;

  // Those within `radius` of p, in no order to rely on but always the same.
  void within(const Vec3& p, double radius, std::vector<Neighbour>& out) const;

  const std::vector<Vec3>& points() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relief
