#include "seams/links.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <set>

#include "measure/closest_point.h"
#include "points/kd_tree.h"
#include "seams/keys.h"
#include "surface/sets.h"

namespace relief {
namespace {

// A link's ends are connected near it if a way along the surface stays within half its length and so many
// grid spacings of its middle: a border's pixels are about a spacing from the patch's true border.
constexpr double kAround = 1.0;
constexpr int kMostFaces = 20000;  // a ball that holds more is not searched; the link counts as right
constexpr size_t kNearestPairs = 24;

// Whether the surface connects two of its faces inside of balls.
class BallSearch {
 public:
  explicit BallSearch(const Surface& surface) : s_(surface), stamp_(surface.faces.size(), 0) {}

  bool connected(int from, int to, const Vec3& centre, double radius) {
    if (from == to) return true;
    mark_++;
    const double limit = radius * radius;
    stack_.assign(1, from);
    stamp_[size_t(from)] = mark_;
    int visited = 0;
    for (size_t i = 0; i < stack_.size(); i++)
      for (int g : s_.adjacent[size_t(stack_[i])]) {
        if (g < 0 || stamp_[size_t(g)] == mark_) continue;
        if (g == to) return true;
        stamp_[size_t(g)] = mark_;
        const auto& f = s_.faces[size_t(g)];
        if (squared_distance(centre, s_.vertices[size_t(f[0])], s_.vertices[size_t(f[1])],
                             s_.vertices[size_t(f[2])]) > limit)
          continue;
        if (++visited > kMostFaces) return true;
        stack_.push_back(g);
      }
    return false;
  }

 private:
  const Surface& s_;
  std::vector<uint32_t> stamp_;
  uint32_t mark_ = 0;
  std::vector<int> stack_;
};

bool connected_near(BallSearch& search, const DecodedMesh& d, const Ground& g, uint32_t a, uint32_t b,
                    double around) {
  const Vec3 p = g.lattice(d.mesh.positions[a]), q = g.lattice(d.mesh.positions[b]);
  const double radius = (p - q).norm() / 2 + around * std::max(g.spacing[a], g.spacing[b]);
  return search.connected(g.face[a], g.face[b], (p + q) / 2, radius);
}

// All that connected_near looks at.
uint64_t key_of_link(const DecodedMesh& d, const Ground& g, uint32_t a, uint32_t b) {
  uint64_t key = 0;
  for (uint32_t v : {a, b}) {
    key = mixed(key ^ key_of(d.mesh.positions[v]));
    key = mixed(key ^ uint64_t(uint32_t(g.face[v])));
    key = mixed(key ^ std::bit_cast<uint64_t>(g.spacing[v]));
  }
  return key;
}

struct NodePair {
  double distance;
  uint32_t a, b;  // nodes
};

bool shorter(const NodePair& x, const NodePair& y) {
  return std::tie(x.distance, x.a, x.b) < std::tie(y.distance, y.a, y.b);
}

// Nodes with the group and component that each belongs to.
struct Grouped {
  const Nodes& nodes;
  const KdTree& tree;  // of their places
  std::vector<int> group, component;

  bool may_join(uint32_t a, uint32_t b) const {
    return group[a] != group[b] && component[a] == component[b] && !neighbouring_pixels(nodes[a], nodes[b]);
  }

  // The nearest node that one may be joined to, no farther than so much; the node itself if there is none.
  NodePair nearest(uint32_t a, double farthest, std::vector<Neighbour>& found) const {
    for (size_t count = 16;; count *= 4) {
      tree.nearest(tree.points()[a], count, found);
      for (const Neighbour& n : found)
        if (may_join(a, n.index)) return {n.squared, a, n.index};
      if (found.size() < count || found.back().squared > farthest) return {INFINITY, a, a};
    }
  }

  // The nearest pairs of a node in group `from` and one of another group of the same component.
  std::vector<NodePair> nearest_pairs(int from) const {
    std::vector<NodePair> pairs;  // the shortest first
    std::vector<Neighbour> found;
    for (uint32_t a = 0; a < group.size(); a++) {
      if (group[a] != from) continue;
      const NodePair best =
          nearest(a, pairs.size() < kNearestPairs ? INFINITY : pairs.back().distance, found);
      if (best.a == best.b) continue;
      pairs.insert(std::upper_bound(pairs.begin(), pairs.end(), best, shorter), best);
      pairs.resize(std::min(kNearestPairs, pairs.size()));
    }
    return pairs;
  }
};

}  // namespace

Ground ground_of(const Surface& surface, const std::vector<CodedPatch>& patches, double spacing) {
  Ground g = {surface, pixels_of(patches), {}, {}};
  for (const Pixel& p : g.pixel) {
    g.face.push_back(patches[p.patch].face[p.index]);
    g.spacing.push_back(spacing * quarter_power(-patches[p.patch].header.spacing_index));
  }
  return g;
}

std::vector<uint32_t> wrong_links(const DecodedMesh& decoded, const Ground& ground, KnownLinks& known) {
  struct Unknown {
    uint32_t a, b;  // vertices
    char* right;
  };
  std::vector<Unknown> unknown;
  std::vector<const char*> right;  // of each link
  for (const auto& [m, n] : decoded.links) {
    const uint32_t a = decoded.nodes[m], b = decoded.nodes[n];
    const auto [at, fresh] = known.insert({key_of_link(decoded, ground, a, b), 0});
    if (fresh) unknown.push_back({a, b, &at->second});
    right.push_back(&at->second);
  }
  tbb::enumerable_thread_specific<BallSearch> local([&] { return BallSearch(ground.surface); });
  tbb::parallel_for(size_t(0), unknown.size(), [&](size_t i) {
    *unknown[i].right = connected_near(local.local(), decoded, ground, unknown[i].a, unknown[i].b, kAround);
  });
  std::vector<uint32_t> numbers;
  for (uint32_t i = 0; i < right.size(); i++)
    if (!*right[i]) numbers.push_back(i);
  return numbers;
}

Pieces join_parts(const DecodedMesh& decoded, const Ground& ground, const std::vector<int>& part, int parts,
                  const std::vector<uint32_t>& dropped) {
  Pieces p;
  p.part = part;
  Sets sets{size_t(parts)};
  for (uint32_t i = 0, k = 0; i < decoded.links.size(); i++) {
    if (k < dropped.size() && dropped[k] == i) {
      k++;
      continue;
    }
    sets.join(p.part[decoded.nodes[decoded.links[i][0]]], p.part[decoded.nodes[decoded.links[i][1]]]);
  }
  std::vector<int> number(size_t(parts), -1);
  p.group.resize(size_t(parts));
  int groups = 0;
  for (size_t i = 0; i < size_t(parts); i++) {
    int& n = number[sets.find(uint32_t(i))];
    if (n < 0) n = groups++;
    p.group[i] = n;
  }
  p.component.assign(size_t(groups), -1);
  p.pixels.assign(size_t(groups), 0);
  for (size_t v = 0; v < p.part.size(); v++) {
    const size_t group = size_t(p.group[size_t(p.part[v])]);
    p.component[group] = ground.surface.component[size_t(ground.face[v])];
    p.pixels[group]++;
  }
  p.main.assign(ground.surface.component_area.size(), -1);
  for (int group = 0; group < groups; group++) {
    int& main = p.main[size_t(p.component[size_t(group)])];
    if (main < 0 || p.pixels[size_t(group)] > p.pixels[size_t(main)]) main = group;
  }
  return p;
}

std::vector<std::array<uint32_t, 2>> missing_links(const DecodedMesh& decoded, const Nodes& nodes,
                                                   const Ground& ground, const Pieces& pieces) {
  std::vector<std::array<uint32_t, 2>> added;
  bool all = true;
  for (size_t g = 0; g < pieces.component.size(); g++)
    all = all && pieces.main[size_t(pieces.component[g])] == int(g);
  if (all) return added;
  BallSearch search(ground.surface);
  std::set<std::pair<uint32_t, uint32_t>> known;  // the decoder adds none of these a second time
  for (const auto& [a, b] : decoded.links) known.insert(std::minmax(a, b));
  Sets sets(pieces.component.size());
  std::vector<Vec3> places;
  for (uint32_t v : decoded.nodes) places.push_back(ground.lattice(decoded.mesh.positions[v]));
  const KdTree tree(places);
  Grouped all_nodes = {nodes, tree, std::vector<int>(places.size()), std::vector<int>(places.size())};
  auto renew = [&] {
    for (size_t n = 0; n < decoded.nodes.size(); n++) {
      const int g = pieces.group[size_t(pieces.part[decoded.nodes[n]])];
      all_nodes.group[n] = int(sets.find(uint32_t(g)));
      all_nodes.component[n] = pieces.component[size_t(g)];
    }
  };
  renew();
  for (int g = 0; g < int(pieces.component.size()); g++) {
    const int main = pieces.main[size_t(pieces.component[size_t(g)])];
    if (sets.find(g) == sets.find(main)) continue;
    const std::vector<NodePair> pairs = all_nodes.nearest_pairs(int(sets.find(uint32_t(g))));
    auto taken = [&](const NodePair& p) {
      return known.count(std::minmax(p.a, p.b)) > 0 ||
             std::any_of(added.begin(), added.end(), [&](auto& l) { return l[0] == std::min(p.a, p.b); });
    };
    auto good = [&](const NodePair& p) {
      return !taken(p) &&
             connected_near(search, decoded, ground, decoded.nodes[p.a], decoded.nodes[p.b], 2 * kAround);
    };
    auto best = std::find_if(pairs.begin(), pairs.end(), good);
    if (best == pairs.end()) best = std::find_if_not(pairs.begin(), pairs.end(), taken);
    if (best == pairs.end()) continue;
    added.push_back({std::min(best->a, best->b), std::max(best->a, best->b)});
    sets.join(uint32_t(all_nodes.group[best->a]), uint32_t(all_nodes.group[best->b]));
    renew();
  }
  std::sort(added.begin(), added.end());
  return added;
}

std::vector<std::array<uint32_t, 2>> links_from(const DecodedMesh& decoded, const Ground& ground,
                                                const std::vector<uint32_t>& nodes,
                                                const std::vector<std::array<uint32_t, 2>>& added,
                                                size_t most) {
  constexpr double kReach = 6, kApart = 3;        // spacings
  constexpr size_t kEach = 3;                     // from a node
  std::set<std::pair<uint32_t, uint32_t>> known;  // at these nodes
  std::set<uint32_t> lower;
  auto wanted = [&](uint32_t n) { return std::find(nodes.begin(), nodes.end(), n) != nodes.end(); };
  for (const auto& [a, b] : decoded.links)
    if (wanted(a) || wanted(b)) known.insert(std::minmax(a, b));
  for (const auto& [a, b] : added) lower.insert(a);
  std::vector<Vec3> place;
  for (uint32_t v : decoded.nodes) place.push_back(ground.lattice(decoded.mesh.positions[v]));
  BallSearch search(ground.surface);
  std::vector<NodePair> pairs;
  for (uint32_t a : nodes) {
    const uint32_t u = decoded.nodes[a];
    std::vector<NodePair> near;
    for (uint32_t b = 0; b < decoded.nodes.size(); b++) {
      const uint32_t v = decoded.nodes[b];
      const double distance = (place[a] - place[b]).norm() / std::max(ground.spacing[u], ground.spacing[v]);
      if (a == b || distance > kReach || known.count(std::minmax(a, b)) || lower.count(std::min(a, b)))
        continue;
      if (ground.pixel[u].patch == ground.pixel[v].patch && distance < kApart) continue;
      near.push_back({distance, std::min(a, b), std::max(a, b)});
    }
    std::sort(near.begin(), near.end(), shorter);
    size_t found = 0;
    for (const NodePair& p : near) {
      if (!connected_near(search, decoded, ground, decoded.nodes[p.a], decoded.nodes[p.b], kAround)) continue;
      pairs.push_back(p);
      if (++found == kEach) break;
    }
  }
  std::sort(pairs.begin(), pairs.end(), shorter);
  std::vector<std::array<uint32_t, 2>> links;
  for (const NodePair& p : pairs)
    if (links.size() < most && (links.empty() || links.back() != std::array{p.a, p.b}))
      links.push_back({p.a, p.b});
  return links;
}

}  // namespace relief
