#include "partition/label_diffusion.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace relief {
namespace {

constexpr int kReach = 14;  // rings; what 24 steps carry beyond is less than a thousandth

// How much of each of a few patches there is at a face. Where more meet, the weakest is forgotten.
struct Mixture {
  static constexpr int kMost = 4;
  int count = 0;
  int label[kMost];
  float weight[kMost];

  void add(int l, float w) {
    for (int i = 0; i < count; ++i)
      if (label[i] == l) {
        weight[i] += w;
        return;
      }
    if (count < kMost) {
      label[count] = l;
      weight[count++] = w;
      return;
    }
    const auto least = std::min_element(weight, weight + kMost) - weight;
    if (weight[least] >= w) return;
    label[least] = l;
    weight[least] = w;
  }
};

// A face near a boundary.
struct BandFace {
  int face;
  int beside[3];   // neighbours: their place in the band; or, outside of it, -1 - their label
  float share[4];  // of the areas of the face itself and its neighbours in their sum; 0 where there is no
                   // neighbour
};

// The faces less than `rings` rings away from a boundary, ring by ring. Ring r ends at ring_end[r].
std::vector<BandFace> band_around_boundaries(const Surface& surface, const std::vector<int>& label, int rings,
                                             std::vector<int>& slot, std::vector<size_t>& ring_end) {
  slot.assign(label.size(), -1);
  std::vector<BandFace> band;
  const auto append = [&](int f) {
    if (slot[f] >= 0) return;
    slot[f] = static_cast<int>(band.size());
    band.push_back({f, {}, {}});
  };
  for (size_t f = 0; f < label.size(); ++f)
    for (int g : surface.adjacent[f])
      if (g >= 0 && label[g] != label[f]) append(static_cast<int>(f));
  ring_end.assign(1, band.size());
  for (int ring = 1; ring < rings; ++ring) {
    for (size_t i = ring < 2 ? 0 : ring_end[ring - 2]; i < ring_end[ring - 1]; ++i)
      for (int g : surface.adjacent[band[i].face])
        if (g >= 0) append(g);
    ring_end.push_back(band.size());
  }
  tbb::parallel_for(size_t{0}, band.size(), [&](size_t i) {
    BandFace& b = band[i];
    const auto& adjacent = surface.adjacent[b.face];
    double total = surface.areas[b.face];
    for (int g : adjacent)
      if (g >= 0) total += surface.areas[g];
    b.share[3] = total > 0 ? static_cast<float>(surface.areas[b.face] / total) : 1;
    for (int k = 0; k < 3; ++k) {
      const int g = adjacent[k];
      if (g < 0) continue;
      b.beside[k] = slot[g] >= 0 ? slot[g] : -1 - label[g];
      b.share[k] = total > 0 ? static_cast<float>(surface.areas[g] / total) : 0;
    }
  });
  return band;
}

Mixture diffused(const BandFace& b, const Mixture& own, const std::vector<Mixture>& now) {
  Mixture sum;
  for (int j = 0; j < own.count; ++j) sum.add(own.label[j], own.weight[j] * b.share[3]);
  for (int k = 0; k < 3; ++k) {
    if (!(b.share[k] > 0)) continue;
    if (b.beside[k] < 0) {
      sum.add(-1 - b.beside[k], b.share[k]);
      continue;
    }
    const Mixture& m = now[b.beside[k]];
    for (int j = 0; j < m.count; ++j) sum.add(m.label[j], m.weight[j] * b.share[k]);
  }
  return sum;
}

}  // namespace

void diffuse_labels(const NormalCone& cone, const Surface& surface, Patches& patches, double epsilon,
                    int rounds, int steps) {
  std::vector<int>& label = patches.label;
  std::vector<int> slot;
  std::vector<size_t> ring_end;
  const int rings = std::min(steps + 1, kReach);
  for (int round = 0; round < rounds; ++round) {
    const std::vector<BandFace> band = band_around_boundaries(surface, label, rings, slot, ring_end);
    std::vector<Mixture> now(band.size()), next;
    for (size_t i = 0; i < band.size(); ++i) now[i].add(label[band[i].face], 1);
    next = now;
    for (int step = 0; step < steps; ++step) {
      // Farther than this the labels are still pure.
      tbb::parallel_for(size_t{0}, ring_end[std::min(step + 1, rings - 1)],
                        [&](size_t i) { next[i] = diffused(band[i], now[i], now); });
      now.swap(next);
    }
    tbb::parallel_for(size_t{0}, band.size(), [&](size_t i) {
      const int f = band[i].face;
      float best = -1;
      int to = label[f];
      for (int j = 0; j < now[i].count; ++j) {
        const int l = now[i].label[j];
        if (now[i].weight[j] > best && (l == label[f] || cone.inside(f, patches.normal[l], epsilon))) {
          best = now[i].weight[j];
          to = l;
        }
      }
      label[f] = to;
    });
    refit(surface, patches);
  }
}

}  // namespace relief
