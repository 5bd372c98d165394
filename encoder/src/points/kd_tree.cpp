#include "points/kd_tree.h"

#include <nanoflann.hpp>

namespace relief {
namespace {

struct Adaptor {
  const std::vector<Vec3>& points;
  size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(size_t i, size_t k) const { return points[i][Eigen::Index(k)]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using Metric = nanoflann::L2_Simple_Adaptor<double, Adaptor, double, uint32_t>;
using Tree = nanoflann::KDTreeSingleIndexAdaptor<Metric, Adaptor, 3, uint32_t>;

// What nanoflann reports its finds to: all within a radius.
struct Ball {
  double squared;
  std::vector<Neighbour>& out;
  bool full() const { return true; }
  double worstDist() const { return squared; }
  bool addPoint(double d, uint32_t index) {
    if (d < squared) out.push_back({index, d});
    return true;
  }
};

// The nearest so many, ties by index: an insertion sort, for counts of a few dozen.
struct Nearest {
  size_t count;
  std::vector<Neighbour>& out;
  bool full() const { return out.size() == count; }
  double worstDist() const { return full() ? out.back().squared : INFINITY; }
  bool addPoint(double d, uint32_t index) {
    auto less = [](const Neighbour& a, const Neighbour& b) {
      return a.squared < b.squared || (a.squared == b.squared && a.index < b.index);
    };
    const Neighbour n = {index, d};
    if (full()) {  // nanoflann knows the worst distance of a while ago
      if (!less(n, out.back())) return true;
      out.pop_back();
    }
    out.insert(std::upper_bound(out.begin(), out.end(), n, less), n);
    return true;
  }
};

}  // namespace

struct KdTree::Impl {
  Adaptor adaptor;
  Tree tree;
  explicit Impl(const std::vector<Vec3>& points)
      : adaptor{points}, tree(3, adaptor, nanoflann::KDTreeSingleIndexAdaptorParams(12)) {}
};

KdTree::KdTree(const std::vector<Vec3>& points) : impl_(std::make_unique<Impl>(points)) {}
KdTree::KdTree(KdTree&&) noexcept = default;
KdTree::~KdTree() = default;

void KdTree::nearest(const Vec3& p, size_t count, std::vector<Neighbour>& out) const {
  out.clear();
  Nearest result{std::min(count, points().size()), out};
  if (result.count > 0) impl_->tree.findNeighbors(result, p.data(), nanoflann::SearchParams());
}

void KdTree::within(const Vec3& p, double radius, std::vector<Neighbour>& out) const {
  out.clear();
  Ball result{radius * radius, out};
  if (!points().empty()) impl_->tree.findNeighbors(result, p.data(), nanoflann::SearchParams());
}

const std::vector<Vec3>& KdTree::points() const { return impl_->adaptor.points; }

}  // namespace relief
