#include "partition/merge.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <queue>
#include <set>
#include <tuple>

namespace relief {
namespace {

// A patch is looked at once for each neighbour, and again when it has grown. This bounds the work where a
// large patch has thousands of small neighbours; merging then stops early. Dragon needs 15.
constexpr size_t kWork = 60;

struct Group {
  std::vector<int> faces;
  Vec3 sum = Vec3::Zero();  // of the normals, weighted by area
  double area = 0;
};

// The plane's normal of the union, or zero if the union leaves the cone.
Vec3 common_cone(const NormalCone& cone, const Group& a, const Group& b) {
  const Vec3 sum = a.sum + b.sum;
  if (!(sum.norm() > 1e-6 * (a.area + b.area))) return Vec3::Zero();
  const Vec3 n = sum.normalized();
  double allowed = cone.tolerance(a.area + b.area);
  // The smaller patch deviates most from the common plane: it decides soonest.
  const bool a_first = a.area < b.area;
  for (const Group* g : {a_first ? &a : &b, a_first ? &b : &a})
    for (int f : g->faces)
      if (!cone.inside(f, n) && (allowed -= cone.cells.area[f]) < 0) return Vec3::Zero();
  return n;
}

bool fits(const NormalCone& cone, const Group& a, const Group& b, const MayMerge& may_merge) {
  const Vec3 n = common_cone(cone, a, b);
  if (n == Vec3::Zero()) return false;
  if (!may_merge) return true;
  std::vector<int> all = a.faces;
  all.insert(all.end(), b.faces.begin(), b.faces.end());
  return may_merge(all, n);
}

std::vector<Group> groups_of(const Surface& surface, const Patches& patches) {
  std::vector<Group> groups(patches.normal.size());
  for (size_t f = 0; f < patches.label.size(); ++f) {
    if (patches.label[f] < 0) continue;
    Group& g = groups[patches.label[f]];
    g.faces.push_back(static_cast<int>(f));
    g.sum += surface.normals[f] * surface.areas[f];
    g.area += surface.areas[f];
  }
  return groups;
}

// Pairs with the longest border first, as many as the budget (of faces to look at) admits.
std::vector<Border> candidates(const Surface& surface, const Patches& patches,
                               const std::vector<Group>& groups, const std::vector<char>& changed,
                               size_t& budget) {
  std::vector<Border> pairs = borders(surface, patches.label);
  std::erase_if(pairs, [&](const Border& e) { return !changed[e.a] && !changed[e.b]; });
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Border& x, const Border& y) { return x.length > y.length; });
  size_t n = 0;
  for (const Border& e : pairs) {
    const size_t work = groups[e.a].faces.size() + groups[e.b].faces.size();
    if (work > budget) continue;
    budget -= work;
    pairs[n++] = e;
  }
  pairs.resize(n);
  return pairs;
}

void absorb(Group& a, Group& b) {
  a.faces.insert(a.faces.end(), b.faces.begin(), b.faces.end());
  a.sum += b.sum;
  a.area += b.area;
  b = {};
}

// One round: every pair is tested as it is at the start; a pair whose patches have changed since is tested
// again. `changed` tells, in and out, which patches changed in a round.
int merge_round(const NormalCone& cone, const Surface& surface, Patches& patches, std::vector<char>& changed,
                size_t& budget, const MayMerge& may_merge) {
  std::vector<Group> groups = groups_of(surface, patches);
  const std::vector<Border> pairs = candidates(surface, patches, groups, changed, budget);
  std::vector<char> ok(pairs.size());
  tbb::parallel_for(size_t{0}, pairs.size(),
                    [&](size_t i) { ok[i] = fits(cone, groups[pairs[i].a], groups[pairs[i].b], may_merge); });
  std::vector<int> into(groups.size());
  for (size_t p = 0; p < into.size(); ++p) into[p] = static_cast<int>(p);
  const auto root = [&](int p) {
    while (into[p] != p) p = into[p] = into[into[p]];
    return p;
  };
  changed.assign(groups.size(), 0);
  int merged = 0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    int a = root(pairs[i].a), b = root(pairs[i].b);
    if (!ok[i] || a == b) continue;
    if (changed[a] || changed[b]) {
      const size_t work = groups[a].faces.size() + groups[b].faces.size();
      if (work > budget) continue;
      budget -= work;
      if (!fits(cone, groups[a], groups[b], may_merge)) continue;
    }
    if (groups[a].faces.size() < groups[b].faces.size()) std::swap(a, b);
    for (int f : groups[b].faces) patches.label[f] = a;
    absorb(groups[a], groups[b]);
    into[b] = a;
    changed[a] = 1;
    ++merged;
  }
  return merged;
}

// What merging raises the cost (4) by. With the average normal as the plane's, J = 2 (area - |sum of
// normals|).
double increment(const Group& a, const Group& b) {
  return 2 * (a.sum.norm() + b.sum.norm() - (a.sum + b.sum).norm());
}

// A pair of neighbours in the queue; void once either has changed.
struct Candidate {
  double increment;
  int a, b, version;  // version: how often both had changed together
  bool operator>(const Candidate& o) const {
    return std::tie(increment, a, b) > std::tie(o.increment, o.a, o.b);
  }
};

}  // namespace

int merge_patches(const NormalCone& cone, const Surface& surface, Patches& patches,
                  const MayMerge& may_merge) {
  int all = 0;
  std::vector<char> changed(patches.normal.size(), 1);
  size_t budget = kWork * surface.faces.size();
  while (const int merged = merge_round(cone, surface, patches, changed, budget, may_merge)) all += merged;
  refit(surface, patches);
  compact(patches);
  return all;
}

void merge_cheapest(const NormalCone& cone, const Surface& surface, Patches& patches) {
  constexpr int kGone = -(1 << 30);
  std::vector<Group> groups = groups_of(surface, patches);
  std::vector<std::set<int>> beside(groups.size());
  std::vector<int> version(groups.size(), 0);
  std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue;
  const auto push = [&](int a, int b) {
    queue.push({increment(groups[a], groups[b]), std::min(a, b), std::max(a, b), version[a] + version[b]});
  };
  for (const Border& e : borders(surface, patches.label)) {
    beside[e.a].insert(e.b);
    beside[e.b].insert(e.a);
    push(e.a, e.b);
  }
  while (!queue.empty()) {
    auto [cost, a, b, changes] = queue.top();
    queue.pop();
    if (changes != version[a] + version[b] || !fits(cone, groups[a], groups[b], {})) continue;
    if (groups[a].faces.size() < groups[b].faces.size()) std::swap(a, b);
    for (int f : groups[b].faces) patches.label[f] = a;
    absorb(groups[a], groups[b]);
    ++version[a];
    version[b] = kGone;
    beside[a].merge(beside[b]);
    beside[a].erase(a);
    beside[a].erase(b);
    for (int c : beside[a]) {
      beside[c].erase(b);
      beside[c].insert(a);
      push(a, c);
    }
  }
  refit(surface, patches);
  compact(patches);
}

}  // namespace relief
