#include "resample/ownership.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace relief {
namespace {

constexpr float kNegligible = 1e-4f;
constexpr float kStay = 1 / 7.0f;  // of a vertex's weights, each round
constexpr int kBand = 12;          // edges from where labels meet; 14 rounds spread a label by about 5

// Vertices of every vertex, as compressed rows.
struct Neighbours {
  std::vector<int> begin, vertex;
};

Neighbours neighbours_of(const Surface& s) {
  Neighbours n;
  n.begin.assign(s.vertices.size() + 1, 0);
  // the next vertex of each face is enough inside; at a border it leaves one neighbour out
  for (const auto& f : s.faces)
    for (int k = 0; k < 3; k++) n.begin[size_t(f[k]) + 1]++;
  for (size_t v = 0; v < s.vertices.size(); v++) n.begin[v + 1] += n.begin[v];
  n.vertex.resize(size_t(n.begin.back()));
  std::vector<int> next(n.begin.begin(), n.begin.end() - 1);
  for (const auto& f : s.faces)
    for (int k = 0; k < 3; k++) {
      n.vertex[size_t(next[f[k]]++)] = f[(k + 1) % 3];
    }
  return n;
}

// Vertices within `rings` edges of one where labels meet, ring by ring. Ring r ends at ring_end[r].
std::vector<int> band_of(const Ownership& o, const Neighbours& n, int rings, std::vector<size_t>& ring_end) {
  std::vector<char> in(o.vertex.size(), 0);
  std::vector<int> band;
  for (size_t v = 0; v < o.vertex.size(); v++)
    if (o.vertex[v].size() > 1) in[v] = 1, band.push_back(int(v));
  size_t begin = 0;
  ring_end.push_back(band.size());
  for (int r = 0; r < rings; r++) {
    const size_t end = band.size();
    for (size_t i = begin; i < end; i++)
      for (int k = n.begin[band[i]]; k < n.begin[band[i] + 1]; k++) {
        const int u = n.vertex[size_t(k)];
        if (!in[u]) in[u] = 1, band.push_back(u);
      }
    begin = end;
    ring_end.push_back(band.size());
  }
  return band;
}

// The only label at a vertex, or -1.
int pure_label(const LabelWeights& w) { return w.size() == 1 ? w[0].first : -1; }

// Whether a vertex and all of its neighbours have one and the same label.
bool same_label(const std::vector<int>& pure, const Neighbours& n, int v) {
  if (pure[size_t(v)] < 0) return false;
  for (int k = n.begin[v]; k < n.begin[v + 1]; k++)
    if (pure[size_t(n.vertex[size_t(k)])] != pure[size_t(v)]) return false;
  return true;
}

}  // namespace

void LabelWeights::add(int label, float weight) {
  Entry* least = entry_;
  for (Entry& e : *this) {
    if (e.first == label) {
      e.second += weight;
      return;
    }
    if (e.second < least->second) least = &e;
  }
  if (count_ < kMost)
    entry_[count_++] = {label, weight};
  else if (least->second < weight)
    *least = {label, weight};
}

void LabelWeights::drop_below(float weight) {
  count_ = int(std::remove_if(begin(), end(), [&](const Entry& e) { return e.second < weight; }) - begin());
}

int Ownership::only_label(const std::array<int, 3>& face) const {
  int label = -1;
  for (int v : face) {
    const int pure = pure_label(vertex[size_t(v)]);
    if (pure < 0 || (label >= 0 && pure != label)) return -1;
    label = pure;
  }
  return label;
}

Ownership diffuse_labels(const Surface& surface, const Partition& partition, int rounds) {
  Ownership o;
  o.vertex.resize(surface.vertices.size());
  const double tiny = surface.total_area / double(surface.faces.size()) * 1e-6;
  for (size_t f = 0; f < surface.faces.size(); f++)
    if (partition.label[f] >= 0)
      for (int v : surface.faces[f])
        o.vertex[size_t(v)].add(partition.label[f], float(surface.areas[f] + tiny));
  for (LabelWeights& w : o.vertex) {
    float sum = 0;
    for (auto& [l, x] : w) sum += x;
    for (auto& [l, x] : w) x /= sum;
  }
  const Neighbours n = neighbours_of(surface);
  std::vector<size_t> ring_end;
  const std::vector<int> band = band_of(o, n, kBand, ring_end);
  std::vector<int> pure(o.vertex.size());
  for (size_t v = 0; v < pure.size(); v++) pure[v] = pure_label(o.vertex[v]);
  std::vector<LabelWeights> next(band.size());
  for (int r = 0; r < rounds; r++) {
    const size_t reached = ring_end[size_t(std::min(r + 1, kBand))];  // beyond, labels are still pure
    tbb::parallel_for(size_t(0), reached, [&](size_t i) {
      const int v = band[i];
      LabelWeights& w = next[i];
      w.clear();
      if (same_label(pure, n, v)) return;
      for (auto& [l, x] : o.vertex[size_t(v)]) w.add(l, x * kStay);
      const float share = (1 - kStay) / float(n.begin[v + 1] - n.begin[v]);
      for (int k = n.begin[v]; k < n.begin[v + 1]; k++)
        for (auto& [l, x] : o.vertex[size_t(n.vertex[size_t(k)])]) w.add(l, x * share);
      w.drop_below(kNegligible);
    });
    tbb::parallel_for(size_t(0), reached, [&](size_t i) {
      if (next[i].size() == 0) return;
      const size_t v = size_t(band[i]);
      o.vertex[v] = next[i];
      pure[v] = pure_label(next[i]);
    });
  }
  return o;
}

}  // namespace relief
