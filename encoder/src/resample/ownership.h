// Which patch owns a point of the surface: labels of faces, diffused over the vertices, so that the borders
// of the masks are smooth at a scale below the triangles.
#pragma once
#include <utility>
#include <vector>

#include "partition/partition.h"
#include "surface/surface.h"

namespace relief {

// A few labels with their weights, in place. Beyond kMost the least is dropped.
class LabelWeights {
 public:
  using Entry = std::pair<int, float>;
  static constexpr int kMost = 6;
  Entry* begin() { return entry_; }
  Entry* end() { return entry_ + count_; }
  const Entry* begin() const { return entry_; }
  const Entry* end() const { return entry_ + count_; }
  int size() const { return count_; }
  const Entry& operator[](int i) const { return entry_[i]; }
  void clear() { count_ = 0; }
  void add(int label, float weight);
  void drop_below(float weight);

 private:
  int count_ = 0;
  Entry entry_[kMost];
};

struct Ownership {
  std::vector<LabelWeights>
      vertex;  // weights of labels at each vertex, sum 1; empty: no face around has a label

  // The only label at the corners of a face, or -1 if there are several.
  int only_label(const std::array<int, 3>& face) const;
};

// rounds: steps of diffusion, each some of the way to the mean of the neighbours.
Ownership diffuse_labels(const Surface& surface, const Partition& partition, int rounds);

}  // namespace relief
