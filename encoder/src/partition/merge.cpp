#include "partition/merge.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace relief {
namespace {

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

// One round: every pair is tested as it is at the start; a pair whose patches have changed since is tested
// again.
int merge_round(const NormalCone& cone, const Surface& surface, Patches& patches, std::vector<char>& changed,
                const MayMerge& may_merge) {
  std::vector<Group> groups = groups_of(surface, patches);
  std::vector<Border> pairs = borders(surface, patches.label);
  std::erase_if(pairs, [&](const Border& e) { return !changed[e.a] && !changed[e.b]; });
  std::vector<char> ok(pairs.size());
  tbb::parallel_for(size_t{0}, pairs.size(),
                    [&](size_t i) { ok[i] = fits(cone, groups[pairs[i].a], groups[pairs[i].b], may_merge); });
  size_t n = 0;
  for (size_t i = 0; i < pairs.size(); ++i)
    if (ok[i]) pairs[n++] = pairs[i];
  pairs.resize(n);
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Border& x, const Border& y) { return x.length > y.length; });

  std::vector<int> into(groups.size());
  for (size_t p = 0; p < into.size(); ++p) into[p] = static_cast<int>(p);
  const auto root = [&](int p) {
    while (into[p] != p) p = into[p] = into[into[p]];
    return p;
  };
  changed.assign(groups.size(), 0);
  int merged = 0;
  for (const Border& e : pairs) {
    int a = root(e.a), b = root(e.b);
    if (a == b || ((changed[a] || changed[b]) && !fits(cone, groups[a], groups[b], may_merge))) continue;
    if (groups[a].faces.size() < groups[b].faces.size()) std::swap(a, b);
    groups[a].faces.insert(groups[a].faces.end(), groups[b].faces.begin(), groups[b].faces.end());
    groups[a].sum += groups[b].sum;
    groups[a].area += groups[b].area;
    for (int f : groups[b].faces) patches.label[f] = a;
    groups[b] = {};
    into[b] = a;
    changed[a] = 1;
    ++merged;
  }
  return merged;
}

}  // namespace

int merge_patches(const NormalCone& cone, const Surface& surface, Patches& patches,
                  const MayMerge& may_merge) {
  int all = 0;
  std::vector<char> changed(patches.normal.size(), 1);
  while (const int merged = merge_round(cone, surface, patches, changed, may_merge)) all += merged;
  refit(surface, patches);
  compact(patches);
  return all;
}

}  // namespace relief
