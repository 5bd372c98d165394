#include "partition/gla.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace relief {
namespace {

constexpr int kMostRounds = 100;          // of growth; Dragon takes about 20
constexpr int kLloydIterations = 3;       // floodings a round
constexpr double kLargeComponent = 0.05;  // share of the area from which a component starts with six seeds

// A first-in-first-out queue of (face, patch) by quantised cost. The paper's priority queue, in constant
// time.
class BucketQueue {
 public:
  static constexpr int kBuckets = 4097;  // costs |n - n_D|^2 of 0 to 4, in steps of 1/1024
  struct Entry {
    int face, patch, next;
  };
  void clear() {
    entries_.clear();
    head_.assign(kBuckets, -1);
    tail_.assign(kBuckets, -1);
    cursor_ = 0;
  }
  void push(int bucket, int face, int patch) {
    const int e = static_cast<int>(entries_.size());
    entries_.push_back({face, patch, -1});
    if (head_[bucket] < 0)
      head_[bucket] = e;
    else
      entries_[tail_[bucket]].next = e;
    tail_[bucket] = e;
    cursor_ = std::min(cursor_, bucket);
  }
  bool pop(Entry& entry) {
    while (cursor_ < kBuckets && head_[cursor_] < 0) ++cursor_;
    if (cursor_ == kBuckets) return false;
    entry = entries_[head_[cursor_]];
    head_[cursor_] = entry.next;
    return true;
  }

 private:
  std::vector<Entry> entries_;
  std::vector<int> head_, tail_;
  int cursor_ = 0;
};

// What flooding reads and writes of a face, in half a cache line.
struct Node {
  Eigen::Vector3f normal;
  std::array<int, 3> adjacent;
  int label;
  int best;  // the lowest bucket in which the face waits
};

struct Lloyd {
  const NormalCone& cone;
  std::vector<Node> nodes;
  std::vector<int> label;               // copy of the nodes' labels while regions are looked for
  std::vector<Vec3> normal;             // of each patch
  std::vector<int> seed;                // face of each patch
  std::vector<std::vector<int>> faces;  // of each patch, in the order of flooding
  std::vector<int> mark, patch_mark;    // of faces and patches: the stamp of the last visit
  int stamp = 0;
  BucketQueue queue;

  explicit Lloyd(const NormalCone& c);
  void add_seed(int face);
  void flood(const std::vector<int>& active);
  void refit(const std::vector<int>& active, bool move_seeds);
  std::vector<int> neighbours(const std::vector<int>& patches);
  bool grow(std::vector<int>& active, std::vector<FoldedRegion>& worst);
};

Lloyd::Lloyd(const NormalCone& c) : cone(c) {
  const Surface& surface = *cone.surface;
  nodes.resize(surface.faces.size());
  mark.assign(surface.faces.size(), -1);
  for (size_t f = 0; f < nodes.size(); ++f) nodes[f] = {cone.normals[f], surface.adjacent[f], -1, 0};
}

void Lloyd::add_seed(int face) {
  seed.push_back(face);
  normal.push_back(nodes[face].normal.cast<double>());
  faces.emplace_back();
  patch_mark.push_back(-1);
}

// Flooding: assigns the faces of the active patches anew, in the order of their normals' distance to the
// plane's.
void Lloyd::flood(const std::vector<int>& active) {
  queue.clear();
  for (int p : active) {
    for (int f : faces[p]) {
      nodes[f].label = -1;
      nodes[f].best = BucketQueue::kBuckets;
    }
    faces[p].clear();
  }
  std::vector<Eigen::Vector3f> plane(normal.size());
  for (int p : active) {
    plane[p] = normal[p].cast<float>();
    nodes[seed[p]].label = -1;  // a new seed lies in a patch of which it takes a part
    nodes[seed[p]].best = 0;
    queue.push(0, seed[p], p);
  }
  BucketQueue::Entry e;
  while (queue.pop(e)) {
    if (nodes[e.face].label >= 0) continue;
    nodes[e.face].label = e.patch;
    faces[e.patch].push_back(e.face);
    for (int g : nodes[e.face].adjacent) {
      if (g < 0 || nodes[g].label >= 0) continue;
      const float cost = (nodes[g].normal - plane[e.patch]).squaredNorm();
      const int bucket = std::min(static_cast<int>(cost * 1024), BucketQueue::kBuckets - 1);
      if (bucket >= nodes[g].best) continue;  // waits in front already
      nodes[g].best = bucket;
      queue.push(bucket, g, e.patch);
    }
  }
}

// Centroid fitting: the average normal, and the face closest to it as the next seed.
void Lloyd::refit(const std::vector<int>& active, bool move_seeds) {
  const Surface& surface = *cone.surface;
  tbb::parallel_for(size_t{0}, active.size(), [&](size_t i) {
    const int p = active[i];
    Vec3 sum = Vec3::Zero();
    double area = 0;
    for (int f : faces[p]) {
      sum += surface.normals[f] * surface.areas[f];
      area += surface.areas[f];
    }
    if (sum.norm() > 1e-6 * area) normal[p] = sum.normalized();
    if (!move_seeds) return;
    float best = 8;
    const Eigen::Vector3f n = normal[p].cast<float>();
    for (int f : faces[p]) {
      const float d = (nodes[f].normal - n).squaredNorm();
      if (d < best) {
        best = d;
        seed[p] = f;
      }
    }
  });
}

// The patches and those beside them, ascending.
std::vector<int> Lloyd::neighbours(const std::vector<int>& patches) {
  std::vector<int> all = patches;
  ++stamp;
  for (int p : patches) patch_mark[p] = stamp;
  for (int p : patches)
    for (int f : faces[p])
      for (int g : nodes[f].adjacent)
        if (g >= 0 && patch_mark[nodes[g].label] != stamp) {
          patch_mark[nodes[g].label] = stamp;
          all.push_back(nodes[g].label);
        }
  std::sort(all.begin(), all.end());
  return all;
}

// Adds a seed to the patches with the largest folded regions, no two of them neighbours. On return `active`
// are the patches to flood again. `worst` holds the largest folded region of each patch, and is brought up to
// date for the patches that were active. Returns false when no patch is folded.
bool Lloyd::grow(std::vector<int>& active, std::vector<FoldedRegion>& worst) {
  worst.resize(normal.size());
  label.resize(nodes.size());
  for (int p : active)
    for (int f : faces[p]) label[f] = p;
  ++stamp;
  tbb::parallel_for(size_t{0}, active.size(), [&](size_t i) {
    const int p = active[i];
    const int* first = faces[p].data();
    worst[p] = {};
    for (FoldedRegion& r :
         folded_regions(cone, label, p, first, first + faces[p].size(), normal[p], mark, stamp))
      if (r.area > worst[p].area) worst[p] = std::move(r);
  });
  std::vector<int> folded;
  for (size_t p = 0; p < normal.size(); ++p)
    if (worst[p].area > 0) folded.push_back(static_cast<int>(p));
  std::stable_sort(folded.begin(), folded.end(), [&](int a, int b) { return worst[a].area > worst[b].area; });
  std::vector<char> blocked(normal.size(), 0);
  std::vector<int> grown;
  for (int p : folded) {
    if (blocked[p]) continue;
    for (int q : neighbours({p})) blocked[q] = 1;
    grown.push_back(p);
  }
  active = neighbours(grown);
  for (int p : grown) {
    active.push_back(static_cast<int>(normal.size()));
    add_seed(worst[p].worst);
  }
  return !grown.empty();
}

// Six seeds at the extreme normals of a large component, one at the largest face of any other.
void first_seeds(Lloyd& lloyd) {
  const Surface& surface = *lloyd.cone.surface;
  const FaceLists lists = faces_by_patch(surface.component, surface.component_area.size());
  for (size_t c = 0; c < surface.component_area.size(); ++c) {
    if (!(surface.component_area[c] > 0)) continue;
    const bool large = surface.component_area[c] >= kLargeComponent * surface.total_area;
    std::vector<int> chosen;
    for (int axis = 0; axis < (large ? 6 : 1); ++axis) {
      const auto value = [&](int f) {
        const double n = lloyd.nodes[f].normal[axis / 2];
        return large ? (axis % 2 ? n : -n) : surface.areas[f];
      };
      const int i = static_cast<int>(c);
      const int f =
          *std::max_element(lists.begin(i), lists.end(i), [&](int a, int b) { return value(a) < value(b); });
      if (std::find(chosen.begin(), chosen.end(), f) == chosen.end()) chosen.push_back(f);
    }
    for (int f : chosen) lloyd.add_seed(f);
    // The first patch of the component holds all of its faces until the first flooding.
    lloyd.faces[lloyd.faces.size() - chosen.size()].assign(lists.begin(static_cast<int>(c)),
                                                           lists.end(static_cast<int>(c)));
  }
}

}  // namespace

Patches generalized_lloyd(const NormalCone& cone, const std::function<void(double)>& progress) {
  Lloyd lloyd(cone);
  first_seeds(lloyd);
  std::vector<int> active(lloyd.normal.size());
  for (size_t p = 0; p < active.size(); ++p) active[p] = static_cast<int>(p);
  std::vector<FoldedRegion> worst;
  for (int round = 0; round < kMostRounds; ++round) {
    for (int i = 0; i < kLloydIterations; ++i) {
      lloyd.flood(active);
      lloyd.refit(active, i + 1 < kLloydIterations);
    }
    if (progress) progress(1 - std::exp(-round / 8.0));
    if (!lloyd.grow(active, worst)) break;
  }
  Patches patches;
  patches.label.assign(lloyd.nodes.size(), -1);
  for (size_t p = 0; p < lloyd.faces.size(); ++p)
    for (int f : lloyd.faces[p]) patches.label[f] = static_cast<int>(p);
  patches.normal = lloyd.normal;
  split_folded(cone, patches);
  compact(patches);
  return patches;
}

}  // namespace relief
