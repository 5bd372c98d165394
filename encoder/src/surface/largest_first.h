// Work on patches side by side.
#pragma once
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace relief {

// visit(i) for each i below n, the largest first, one by one: no thread waits long for another's last one.
template <class Size, class Visit>
void largest_first(size_t n, Size size, Visit visit) {
  std::vector<size_t> order(n);
  std::iota(order.begin(), order.end(), size_t(0));
  std::stable_sort(order.begin(), order.end(), [&](size_t i, size_t j) { return size(i) > size(j); });
  tbb::parallel_for(
      tbb::blocked_range<size_t>(0, n, 1),
      [&](const tbb::blocked_range<size_t>& range) {
        for (size_t i = range.begin(); i < range.end(); i++) visit(order[i]);
      },
      tbb::simple_partitioner());
}

}  // namespace relief
