#include "seams/handles.h"

#include <algorithm>
#include <utility>

#include "seams/keys.h"

namespace relief {
namespace {

constexpr int kMostTrials = 12;
// Links that are left out across a handle that is not made, at least: fewer cross their neighbours.
constexpr size_t kFewLinks = 4;

// Links that were left out although they run along the surface, in groups of neighbours, without those that
// `vain` tells of. The largest group first.
std::vector<std::vector<uint32_t>> missing_handles(const SeamContext& in, const Attempt& a,
                                                   const std::vector<char>& vain) {
  std::vector<std::vector<uint32_t>> groups;
  std::vector<Vec3> last;
  const double near = 4 * in.coded.placement.spacing;
  for (uint32_t link = 0; link < a.decoded.links.size(); link++) {
    if (a.decoded.kind[link] != LinkKind::kRefused || vain[link]) continue;
    const auto& [u, v] = a.decoded.links[link];
    const Vec3 p = (in.ground.lattice(a.decoded.mesh.positions[a.decoded.nodes[u]]) +
                    in.ground.lattice(a.decoded.mesh.positions[a.decoded.nodes[v]])) /
                   2;
    size_t k = 0;
    while (k < groups.size() && (last[k] - p).norm() >= near) k++;
    if (k == groups.size()) groups.emplace_back(), last.emplace_back();
    groups[k].push_back(link);
    last[k] = p;
  }
  std::erase_if(groups, [](auto& g) { return g.size() < kFewLinks; });
  std::stable_sort(groups.begin(), groups.end(), [](auto& x, auto& y) { return x.size() > y.size(); });
  return groups;
}

// A link by the pixels at its ends.
uint64_t key_of(const SeamContext& in, const std::array<uint32_t, 2>& link) {
  uint64_t key = 0;
  for (uint32_t node : link) {
    const Pixel& p = in.ground.pixel[in.plain.nodes[node]];
    key = mixed(key ^ (uint64_t(p.patch) << 32 | p.index));
  }
  return key;
}

}  // namespace

// Makes the handles of the surface. One that is not made leaves out all links across a gap: where a group of
// neighbours was left out, one of them may make a handle. That was right if most of the others are let in
// after it.
void add_handles(const SeamContext& in, Attempt& best) {
  const auto& links = in.plain.links;
  std::vector<char> vain(links.size(), 0);
  for (uint32_t l = 0; l < links.size(); l++)
    vain[l] = best.decoded.kind[l] == LinkKind::kRefused && in.known.vain_handles.count(key_of(in, links[l]));
  auto with_handles = [&](std::vector<uint32_t> handles) {
    return open_holes(in, {best.seams.dropped_links, std::move(handles), best.seams.added_links, {}, {}, {}});
  };
  for (int trial = 0; trial < kMostTrials && best.topology.genus < in.topology.genus; trial++) {
    std::vector<std::vector<uint32_t>> groups = missing_handles(in, best, vain);
    groups.resize(std::min(groups.size(), size_t(in.topology.genus - best.topology.genus)));
    if (groups.empty()) return;
    std::vector<uint32_t> handles = best.seams.handles;
    for (const auto& group : groups) handles.push_back(group[group.size() / 2]);
    Attempt tried = with_handles(handles);
    // those that made none were let in after another: they are in without being asked for
    std::erase_if(handles, [&](uint32_t link) { return tried.decoded.kind[link] != LinkKind::kMade; });
    const size_t made = handles.size();
    for (const auto& group : groups) {
      const auto left = std::count_if(group.begin(), group.end(), [&](uint32_t l) {
        return tried.decoded.kind[l] == LinkKind::kRefused;
      });
      if (size_t(left) * 2 <= group.size()) continue;
      std::erase(handles, group[group.size() / 2]);
      for (uint32_t link : group) vain[link] = 1, in.known.vain_handles.insert(key_of(in, links[link]));
    }
    const bool all = made == handles.size() && tried.seams.handles.size() == made;
    if (!all) in.spare = std::move(tried.decoded);
    if (handles.size() <= best.seams.handles.size()) continue;
    Attempt a = all ? std::move(tried) : with_handles(std::move(handles));
    if (a.mismatch >= best.mismatch) return;
    std::swap(best, a);
    in.spare = std::move(a.decoded);
  }
}

}  // namespace relief
