#include "partition/normal_cone.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace relief {
namespace {

constexpr double kFoldedShare =
    2e-5;  // of the surface's area; measured: smaller values add patches, not precision
constexpr int kSmoothingRounds = 8;     // about as many rings of faces
constexpr int kSmallestSmoothed = 200;  // faces; a smaller component would be smoothed into a ball

// Faces whose normals are smoothed. A face that alone exceeds the tolerated folded area is no noise.
std::vector<char> smoothed_faces(const Surface& surface, double folded_area) {
  std::vector<int> size(surface.component_area.size(), 0);
  for (int c : surface.component) ++size[c];
  std::vector<char> smoothed(surface.faces.size());
  for (size_t f = 0; f < smoothed.size(); ++f)
    smoothed[f] = size[surface.component[f]] >= kSmallestSmoothed && surface.areas[f] <= folded_area;
  return smoothed;
}

}  // namespace

NormalCone make_normal_cone(const Surface& surface, double aperture) {
  NormalCone cone;
  cone.surface = &surface;
  cone.cosine = std::cos(aperture * M_PI / 180);
  cone.folded_area = kFoldedShare * surface.total_area;

  const size_t n = surface.faces.size();
  const std::vector<char> smoothed = smoothed_faces(surface, cone.folded_area);
  std::vector<Eigen::Vector3f> next(n);
  cone.normals.resize(n);
  for (size_t f = 0; f < n; ++f) cone.normals[f] = surface.normals[f].cast<float>();
  for (int round = 0; round < kSmoothingRounds; ++round) {
    tbb::parallel_for(size_t{0}, n, [&](size_t f) {
      next[f] = cone.normals[f];
      if (!smoothed[f]) return;
      double weight = surface.areas[f];
      Vec3 sum = cone.normals[f].cast<double>() * weight;
      for (int g : surface.adjacent[f])
        if (g >= 0) {
          sum += cone.normals[g].cast<double>() * surface.areas[g];
          weight += surface.areas[g];
        }
      if (sum.norm() > 0.05 * weight) next[f] = sum.normalized().cast<float>();
    });
    cone.normals.swap(next);
  }
  return cone;
}

double aperture_cosine(const NormalCone& cone, const int* begin, const int* end, const Vec3& n) {
  double least = 1;
  for (const int* f = begin; f != end; ++f)
    least = std::min(
        least, std::max<double>(cone.normals[*f].dot(n.cast<float>()), cone.surface->normals[*f].dot(n)));
  return least;
}

std::vector<FoldedRegion> folded_regions(const NormalCone& cone, const std::vector<int>& label, int p,
                                         const int* begin, const int* end, const Vec3& n,
                                         std::vector<int>& mark, int stamp) {
  const Surface& surface = *cone.surface;
  std::vector<FoldedRegion> regions;
  double patch_area = 0;
  for (const int* f = begin; f != end; ++f) {
    patch_area += surface.areas[*f];
    if (mark[*f] == stamp || cone.inside(*f, n)) continue;
    FoldedRegion region;
    float least = 2;
    region.faces.push_back(*f);
    mark[*f] = stamp;
    for (size_t i = 0; i < region.faces.size(); ++i) {
      const int g = region.faces[i];
      region.area += surface.areas[g];
      const float c = cone.normals[g].dot(n.cast<float>());
      if (c < least) {
        least = c;
        region.worst = g;
      }
      for (int h : surface.adjacent[g])
        if (h >= 0 && label[h] == p && mark[h] != stamp && !cone.inside(h, n)) {
          mark[h] = stamp;
          region.faces.push_back(h);
        }
    }
    regions.push_back(std::move(region));
  }
  const double tolerance = cone.tolerance(patch_area);
  std::erase_if(regions, [&](const FoldedRegion& r) { return r.area <= tolerance; });
  return regions;
}

int split_folded(const NormalCone& cone, Patches& patches) {
  const Surface& surface = *cone.surface;
  std::vector<int> mark(surface.faces.size(), -1);
  int cut = 0;
  // A face alone is always inside of its own cone, so this ends; ten rounds have never been needed.
  for (int round = 0; round < 1000; ++round) {
    const size_t count = patches.normal.size();
    const FaceLists lists = faces_by_patch(patches.label, count);
    std::vector<std::vector<FoldedRegion>> regions(count);
    tbb::parallel_for(size_t{0}, count, [&](size_t p) {
      const int i = static_cast<int>(p);
      regions[p] = folded_regions(cone, patches.label, i, lists.begin(i), lists.end(i), patches.normal[p],
                                  mark, round);
    });
    for (size_t p = 0; p < count; ++p)
      for (const FoldedRegion& r : regions[p]) {
        // A patch that is folded as a whole (its normals cancel out) is split by the direction of its worst
        // face.
        const bool whole = r.faces.size() == static_cast<size_t>(lists.size(static_cast<int>(p)));
        const Vec3 n = cone.normals[r.worst].cast<double>();
        const int fresh = static_cast<int>(patches.normal.size());
        const auto moves = [&](int f) { return !whole || cone.inside(f, n); };
        if (std::all_of(r.faces.begin(), r.faces.end(), moves) && whole) continue;
        for (int f : r.faces)
          if (moves(f)) patches.label[f] = fresh;
        patches.normal.push_back(n);
      }
    if (patches.normal.size() == count) break;
    cut += static_cast<int>(patches.normal.size() - count);
    refit(surface, patches);
  }
  return cut;
}

}  // namespace relief
