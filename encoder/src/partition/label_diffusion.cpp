#include "partition/label_diffusion.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace relief {
namespace {

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

// The faces less than `rings` rings away from a boundary, ascending; `slot` is set to their places, -1
// elsewhere.
std::vector<int> band_around_boundaries(const Surface& surface, const std::vector<int>& label, int rings,
                                        std::vector<int>& slot) {
  slot.assign(label.size(), -1);
  std::vector<int> front, band;
  for (size_t f = 0; f < label.size(); ++f)
    for (int g : surface.adjacent[f])
      if (g >= 0 && label[g] != label[f]) {
        slot[f] = 0;
        front.push_back(static_cast<int>(f));
        break;
      }
  for (int ring = 0; ring < rings; ++ring) {
    band.insert(band.end(), front.begin(), front.end());
    std::vector<int> next;
    for (int f : front)
      for (int g : surface.adjacent[f])
        if (g >= 0 && slot[g] < 0) {
          slot[g] = 0;
          next.push_back(g);
        }
    front.swap(next);
  }
  for (int f : front) slot[f] = -1;
  std::sort(band.begin(), band.end());
  for (size_t i = 0; i < band.size(); ++i) slot[band[i]] = static_cast<int>(i);
  return band;
}

}  // namespace

void diffuse_labels(const NormalCone& cone, const Surface& surface, Patches& patches, double epsilon,
                    int rounds, int steps) {
  std::vector<int>& label = patches.label;
  std::vector<int> slot;
  for (int round = 0; round < rounds; ++round) {
    const std::vector<int> band = band_around_boundaries(surface, label, steps + 1, slot);
    std::vector<Mixture> now(band.size()), next(band.size());
    tbb::parallel_for(size_t{0}, band.size(), [&](size_t i) { now[i].add(label[band[i]], 1); });
    for (int step = 0; step < steps; ++step) {
      tbb::parallel_for(size_t{0}, band.size(), [&](size_t i) {
        Mixture sum;
        const auto gather = [&](int f, float area) {
          if (slot[f] < 0) return sum.add(label[f], area);
          const Mixture& m = now[slot[f]];
          for (int j = 0; j < m.count; ++j) sum.add(m.label[j], m.weight[j] * area);
        };
        double total = surface.areas[band[i]];
        gather(band[i], static_cast<float>(total));
        for (int g : surface.adjacent[band[i]])
          if (g >= 0) {
            gather(g, static_cast<float>(surface.areas[g]));
            total += surface.areas[g];
          }
        if (!(total > 0)) return void(next[i] = now[i]);
        for (int j = 0; j < sum.count; ++j) sum.weight[j] = static_cast<float>(sum.weight[j] / total);
        next[i] = sum;
      });
      now.swap(next);
    }
    tbb::parallel_for(size_t{0}, band.size(), [&](size_t i) {
      const int f = band[i];
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
