#include "partition/gla.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace relief {
namespace {

constexpr int kMostRounds = 100;          // of growth; Dragon takes about 30
constexpr int kCellFaces = 8;             // most faces of a cell on the coarse level
constexpr size_t kMostCells = 1 << 17;    // about; beyond, cells are larger
constexpr int kCoarseIterations = 4;      // floodings a round
constexpr int kFineIterations = 2;        // likewise, on faces
constexpr double kLargeComponent = 0.05;  // share of the area from which a component starts with six seeds

// A first-in-first-out queue of (cell, patch) by quantised cost. The paper's priority queue, in constant
// time.
class BucketQueue {
 public:
  static constexpr int kBuckets = 4097;  // costs |n - n_D|^2 of 0 to 4, in steps of 1/1024
  struct Entry {
    int cell, patch, next;
  };
  void clear() {
    entries_.clear();
    head_.assign(kBuckets, -1);
    tail_.assign(kBuckets, -1);
    free_ = -1;
    cursor_ = 0;
  }
  void push(int bucket, int cell, int patch) {
    const int e = free_ < 0 ? static_cast<int>(entries_.size()) : free_;
    if (free_ < 0)
      entries_.push_back({cell, patch, -1});
    else {
      free_ = entries_[e].next;
      entries_[e] = {cell, patch, -1};
    }
    (head_[bucket] < 0 ? head_[bucket] : entries_[tail_[bucket]].next) = e;
    tail_[bucket] = e;
    cursor_ = std::min(cursor_, bucket);
  }
  bool pop(Entry& entry) {
    while (cursor_ < kBuckets && head_[cursor_] < 0) ++cursor_;
    if (cursor_ == kBuckets) return false;
    const int e = head_[cursor_];
    entry = entries_[e];
    head_[cursor_] = entry.next;
    entries_[e].next = free_;
    free_ = e;
    return true;
  }

 private:
  std::vector<Entry> entries_;
  std::vector<int> head_, tail_;  // of buckets
  int free_ = -1;                 // entries that came out, used again: so all lie near
  int cursor_ = 0;
};

// What flooding reads and writes of a cell, side by side in memory.
struct Node {
  Eigen::Vector3f normal;
  int label;
  int best;   // the lowest bucket in which the cell waits; -1 when it has a label
  int first;  // neighbour
};

class Lloyd {
 public:
  explicit Lloyd(const NormalCone& c) : cone(c), cells(c.cells), label(cells.area.size(), -1) {
    mark_ = label;
    for (size_t i = 0; i < label.size(); ++i)
      nodes_.push_back({cells.smooth[i], -1, BucketQueue::kBuckets, cells.first[i]});
    nodes_.push_back({Eigen::Vector3f::Zero(), -1, 0, cells.first.back()});
  }

  void add_patch(int seed_cell, const Vec3& plane_normal);
  void run(int iterations, const std::function<void(double)>& progress);

  const NormalCone& cone;
  const Cells& cells;
  std::vector<int> label;                 // patch of each cell
  std::vector<Vec3> normal;               // of each patch's plane
  std::vector<int> seed;                  // cell of each patch
  std::vector<std::vector<int>> members;  // cells of each patch, in the order of flooding

 private:
  void flood(const std::vector<int>& active);
  void clear(const std::vector<int>& active);
  void refit(int p, bool move_seed);
  bool grow(std::vector<int>& active);
  std::vector<int> with_neighbours(const std::vector<int>& patches);

  std::vector<Node> nodes_;
  std::vector<int> mark_, patch_mark_;  // of cells and patches: the stamp of the last visit
  int stamp_ = 0;
  std::vector<FoldedRegion> folded_;  // of each patch: its largest folded region
  BucketQueue queue_;
};

void Lloyd::add_patch(int seed_cell, const Vec3& plane_normal) {
  seed.push_back(seed_cell);
  normal.push_back(plane_normal);
  members.emplace_back();
  patch_mark_.push_back(-1);
}

// Takes all cells from the active patches.
void Lloyd::clear(const std::vector<int>& active) {
  const auto take = [&](int c) {
    nodes_[c].label = -1;
    nodes_[c].best = BucketQueue::kBuckets;
  };
  ++stamp_;
  size_t count = 0;
  for (int p : active) {
    patch_mark_[p] = stamp_;
    count += members[p].size();
  }
  if (count > label.size() / 4)  // in the order of memory, which is faster
    tbb::parallel_for(size_t{0}, label.size(), [&](size_t c) {
      if (label[c] >= 0 && patch_mark_[label[c]] == stamp_) take(static_cast<int>(c));
    });
  else
    for (int p : active)
      for (int c : members[p]) take(c);
  for (int p : active) members[p].clear();
}

// Flooding: assigns the cells of the active patches anew, in the order of their normals' distance to the
// plane's.
void Lloyd::flood(const std::vector<int>& active) {
  clear(active);
  queue_.clear();
  std::vector<Eigen::Vector3f> plane(normal.size());
  for (int p : active) {
    plane[p] = normal[p].cast<float>();
    nodes_[seed[p]].best = 0;
    queue_.push(0, seed[p], p);
  }
  BucketQueue::Entry e;
  while (queue_.pop(e)) {
    Node& node = nodes_[e.cell];
    if (node.label >= 0) continue;
    node.label = e.patch;
    node.best = -1;
    members[e.patch].push_back(e.cell);
    for (int j = node.first; j < nodes_[e.cell + 1].first; ++j)
      __builtin_prefetch(&nodes_[cells.neighbour[j]]);
    for (int j = node.first; j < nodes_[e.cell + 1].first; ++j) {
      const int c = cells.neighbour[j];
      Node& other = nodes_[c];
      const float cost = (other.normal - plane[e.patch]).squaredNorm();
      const int bucket = std::min(static_cast<int>(cost * 1024), BucketQueue::kBuckets - 1);
      if (bucket >= other.best) continue;  // another entry comes out first
      other.best = bucket;
      queue_.push(bucket, c, e.patch);
      __builtin_prefetch(&cells.neighbour[other.first]);
    }
  }
  tbb::parallel_for(size_t{0}, label.size(), [&](size_t c) { label[c] = nodes_[c].label; });
}

// Centroid fitting: the average normal, and the cell closest to it as the next seed.
void Lloyd::refit(int p, bool move_seed) {
  Vec3 sum = Vec3::Zero();
  double area = 0;
  for (int c : members[p]) {
    sum += cells.own[c].cast<double>() * cells.area[c];
    area += cells.area[c];
  }
  if (sum.norm() > 1e-6 * area) normal[p] = sum.normalized();
  if (!move_seed) return;
  float best = 8;
  const Eigen::Vector3f n = normal[p].cast<float>();
  for (int c : members[p]) {
    const float d = (cells.smooth[c] - n).squaredNorm();
    if (d >= best) continue;
    best = d;
    seed[p] = c;
  }
}

// The patches and those beside them, ascending.
std::vector<int> Lloyd::with_neighbours(const std::vector<int>& patches) {
  std::vector<int> all = patches;
  ++stamp_;
  for (int p : patches) patch_mark_[p] = stamp_;
  for (int p : patches)
    for (int c : members[p])
      for (int j = cells.first[c]; j < cells.first[c + 1]; ++j) {
        const int q = label[cells.neighbour[j]];
        if (patch_mark_[q] == stamp_) continue;
        patch_mark_[q] = stamp_;
        all.push_back(q);
      }
  std::sort(all.begin(), all.end());
  return all;
}

// Adds a seed to the patches with the largest folded regions, no two of them neighbours. On entry `active`
// are the patches that have changed, on return those to flood again. Returns false when no patch is folded.
bool Lloyd::grow(std::vector<int>& active) {
  folded_.resize(normal.size());
  ++stamp_;
  tbb::parallel_for(size_t{0}, active.size(), [&](size_t i) {
    const int p = active[i];
    const int* first = members[p].data();
    folded_[p] = {};
    for (auto& r : folded_regions(cone, label, p, first, first + members[p].size(), normal[p], mark_, stamp_))
      if (r.area > folded_[p].area) folded_[p] = std::move(r);
  });
  std::vector<int> order;
  for (size_t p = 0; p < normal.size(); ++p)
    if (folded_[p].area > 0 && folded_[p].worst != seed[p]) order.push_back(static_cast<int>(p));
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return folded_[a].area > folded_[b].area; });
  std::vector<char> blocked(normal.size(), 0);
  std::vector<int> grown;
  for (int p : order) {
    if (blocked[p]) continue;
    for (int q : with_neighbours({p})) blocked[q] = 1;
    grown.push_back(p);
  }
  active = with_neighbours(grown);
  for (int p : grown) {
    active.push_back(static_cast<int>(normal.size()));
    add_patch(folded_[p].worst, cells.smooth[folded_[p].worst].cast<double>());
  }
  return !grown.empty();
}

void Lloyd::run(int iterations, const std::function<void(double)>& progress) {
  std::vector<int> active(normal.size());
  for (size_t p = 0; p < active.size(); ++p) active[p] = static_cast<int>(p);
  for (int round = 0; round < kMostRounds; ++round) {
    for (int i = 0; i < iterations; ++i) {
      flood(active);
      tbb::parallel_for(size_t{0}, active.size(), [&](size_t j) { refit(active[j], i + 1 < iterations); });
    }
    if (progress) progress(1 - std::exp(-(round + 1) / 8.0));
    if (!grow(active)) break;
  }
}

// Six seeds at the extreme normals of a large component, one at the largest cell of any other.
void first_seeds(Lloyd& lloyd, const std::vector<int>& component, const Surface& surface) {
  const Cells& cells = lloyd.cells;
  const FaceLists lists = faces_by_patch(component, surface.component_area.size());
  for (size_t i = 0; i < surface.component_area.size(); ++i) {
    if (!(surface.component_area[i] > 0)) continue;
    const int c = static_cast<int>(i);
    const bool large = surface.component_area[c] >= kLargeComponent * surface.total_area;
    std::vector<int> chosen;
    for (int axis = 0; axis < (large ? 6 : 1); ++axis) {
      const auto value = [&](int f) {
        const double n = cells.smooth[f][axis / 2];
        return large ? (axis % 2 ? n : -n) : cells.area[f];
      };
      const int f =
          *std::max_element(lists.begin(c), lists.end(c), [&](int a, int b) { return value(a) < value(b); });
      if (std::find(chosen.begin(), chosen.end(), f) == chosen.end()) chosen.push_back(f);
    }
    const size_t first = lloyd.members.size();
    for (int f : chosen) lloyd.add_patch(f, cells.smooth[f].cast<double>());
    lloyd.members[first].assign(lists.begin(c), lists.end(c));  // until the first flooding
  }
}

// Continues on faces what was done on cells.
void refine_seeds(Lloyd& fine, const Lloyd& coarse, const std::vector<int>& cell) {
  std::vector<float> best(coarse.normal.size(), 8);
  std::vector<int> seed(coarse.normal.size(), -1);
  for (size_t f = 0; f < cell.size(); ++f) {
    const int p = coarse.label[cell[f]];
    if (p < 0 || coarse.seed[p] != cell[f]) continue;
    const float d = (fine.cells.smooth[f] - coarse.normal[p].cast<float>()).squaredNorm();
    if (d >= best[p]) continue;
    best[p] = d;
    seed[p] = static_cast<int>(f);
  }
  std::vector<int> number(coarse.normal.size(), -1);
  for (size_t p = 0; p < coarse.normal.size(); ++p) {
    if (seed[p] < 0) continue;  // no cells
    number[p] = static_cast<int>(fine.normal.size());
    fine.add_patch(seed[p], coarse.normal[p]);
  }
  for (size_t f = 0; f < cell.size(); ++f) {
    const int p = coarse.label[cell[f]];
    if (p >= 0) fine.members[number[p]].push_back(static_cast<int>(f));
  }
}

}  // namespace

Patches generalized_lloyd(const NormalCone& cone, const Surface& surface,
                          const std::function<void(double)>& progress) {
  std::vector<int> cell;
  const int cell_faces = std::max(kCellFaces, static_cast<int>(surface.faces.size() / kMostCells));
  const NormalCone coarse_cone = coarsen(cone, cell_faces, cell);
  std::vector<int> component(coarse_cone.cells.area.size());
  for (size_t f = 0; f < cell.size(); ++f) component[cell[f]] = surface.component[f];
  Lloyd coarse(coarse_cone);
  first_seeds(coarse, component, surface);
  coarse.run(kCoarseIterations, [&](double done) { progress(0.5 * done); });

  Lloyd fine(cone);
  refine_seeds(fine, coarse, cell);
  fine.run(kFineIterations, [&](double done) { progress(0.5 + 0.5 * done); });
  Patches patches{std::move(fine.label), std::move(fine.normal)};
  split_folded(cone, surface, patches);
  compact(patches);
  return patches;
}

}  // namespace relief
