#include "partition/partition.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "partition/boundary_shape.h"
#include "partition/connected.h"
#include "partition/enclosing_cone.h"
#include "partition/gla.h"
#include "partition/label_diffusion.h"
#include "partition/merge.h"
#include "partition/normal_cone.h"
#include "partition/overlap.h"
#include "partition/split_merge.h"

namespace relief {
namespace {

constexpr double kBoundarySlack = 4;    // degrees; how far beyond the aperture a smoother boundary may reach
constexpr double kWidestAperture = 88;  // degrees; with the slack
constexpr int kDiffusionRounds = 3, kDiffusionSteps = 24;
constexpr int kMostRounds = 10;
constexpr double kSplitAperture = 20;  // degrees; the paper's alpha: the fewest patches of 10 to 80

// Splits what covers pixels twice or leaves the cone. Either can undo the other's condition by moving faces
// and planes: repeats until nothing changes.
void ensure_height_fields(const NormalCone& cone, const Surface& surface, double spacing, Patches& patches) {
  for (int round = 0; round < kMostRounds; ++round) {
    const int splits = split_overlaps(surface, patches, spacing);
    const int folded = split_folded(cone, surface, patches);
    const int adrift = connect_patches(cone, surface, patches, cone.cosine);
    if (splits + folded + adrift == 0) break;
    if (round == 0) optimize_boundary_shape(cone, surface, patches, cone.cosine);
  }
}

double mean_spacing(const Surface& surface, const PartitionOptions& options) {
  return options.spacing > 0 ? options.spacing
                             : std::sqrt(surface.total_area / static_cast<double>(surface.vertices.size()));
}

double widest_aperture(const PartitionOptions& options) {
  return std::max(options.aperture, std::min(options.aperture + kBoundarySlack, kWidestAperture));
}

Patches cluster(const NormalCone& cone, const Surface& surface, Clustering clustering,
                const std::function<void(double)>& progress) {
  if (clustering == Clustering::kSplitMerge) return split_merge(cone, surface, kSplitAperture);
  Patches patches = generalized_lloyd(cone, surface, progress);
  merge_patches(cone, surface, patches, {});
  return patches;
}

// Regions that reach `far` somewhere and kRim of it everywhere, worth a patch of their own.
std::vector<std::vector<int>> missed_regions(const Surface& surface, const Missed& missed,
                                             const std::vector<int>& label) {
  constexpr double kRim = 0.4;
  const auto& distance = missed.distance;
  std::vector<std::vector<int>> regions;
  std::vector<char> seen(surface.faces.size(), 0);
  for (size_t start = 0; start < seen.size(); ++start) {
    if (seen[start] || label[start] < 0 || distance[start] < missed.far) continue;
    std::vector<int> faces{static_cast<int>(start)};
    seen[start] = 1;
    double sum = 0;
    for (size_t i = 0; i < faces.size(); ++i) {
      const int f = faces[i];
      sum += surface.areas[f] * distance[f] * distance[f];
      for (int g : surface.adjacent[f])
        if (g >= 0 && !seen[g] && label[g] >= 0 && distance[g] >= kRim * missed.far) {
          seen[g] = 1;
          faces.push_back(g);
        }
    }
    if (sum >= missed.worth) regions.push_back(std::move(faces));
  }
  return regions;
}

// The axis of the smallest cone around a patch's normals (3.2) in place of their average, where no face
// leaves the aperture by that and the patch stays a height field.
void use_cone_planes(const NormalCone& cone, const Surface& surface, double spacing, Patches& patches) {
  const FaceLists lists = faces_by_patch(patches.label, patches.normal.size());
  tbb::parallel_for(size_t{0}, patches.normal.size(), [&](size_t i) {
    const int p = static_cast<int>(i);
    std::vector<Vec3> normals;
    for (const int* f = lists.begin(p); f != lists.end(p); ++f)
      if (surface.areas[*f] > 0) normals.push_back(cone.cells.smooth[*f].cast<double>().normalized());
    const EnclosingCone smallest = smallest_enclosing_cone(normals);
    if (smallest.cosine >= cone.cosine &&
        is_height_field(find_overlap(surface, lists.begin(p), lists.end(p), smallest.axis, spacing)))
      patches.normal[i] = smallest.axis;
  });
}

}  // namespace

bool split_missed(const Surface& surface, const PartitionOptions& options, const Missed& missed,
                  Partition& partition) {
  const std::vector<std::vector<int>> regions = missed_regions(surface, missed, partition.label);
  if (regions.empty()) return false;
  NormalCone cone = make_normal_cone(surface, widest_aperture(options));
  Patches patches{partition.label, partition.normal};
  for (const std::vector<int>& faces : regions) {
    for (int f : faces) {
      cone.cells.smooth[f] = cone.cells.own[f];  // no noise, as it seems
      patches.label[f] = static_cast<int>(patches.normal.size());
    }
    patches.normal.push_back(surface.normals[faces[0]]);
  }
  refit(surface, patches);
  ensure_height_fields(cone, surface, mean_spacing(surface, options), patches);
  compact(patches);
  if (patches.label == partition.label) return false;
  if (options.plane == Plane::kCone) use_cone_planes(cone, surface, mean_spacing(surface, options), patches);
  partition = {std::move(patches.label), std::move(patches.normal)};
  return true;
}

Partition partition_surface(const Surface& surface, const PartitionOptions& options) {
  const auto progress = [&](double done) {
    if (options.progress) options.progress(done);
  };
  const double spacing = mean_spacing(surface, options);
  const NormalCone cone = make_normal_cone(surface, options.aperture);
  const double epsilon = std::cos(widest_aperture(options) * M_PI / 180);
  NormalCone relaxed = cone;
  relaxed.cosine = epsilon;

  Patches patches = cluster(cone, surface, options.clustering, [&](double done) { progress(0.7 * done); });
  connect_patches(cone, surface, patches, epsilon);
  progress(0.75);
  diffuse_labels(cone, surface, patches, epsilon, kDiffusionRounds, kDiffusionSteps);
  connect_patches(cone, surface, patches, epsilon);
  optimize_boundary_shape(cone, surface, patches, epsilon);
  progress(0.9);
  ensure_height_fields(relaxed, surface, spacing, patches);
  // What the smoother boundaries and the new planes allow now.
  const int merged =
      merge_patches(relaxed, surface, patches, [&](const std::vector<int>& faces, const Vec3& n) {
        return is_height_field(find_overlap(surface, faces.data(), faces.data() + faces.size(), n, spacing));
      });
  progress(0.95);
  if (merged > 0) {
    optimize_boundary_shape(cone, surface, patches, epsilon);
    ensure_height_fields(relaxed, surface, spacing, patches);
  }
  if (options.plane == Plane::kCone) use_cone_planes(relaxed, surface, spacing, patches);
  progress(1);
  return {std::move(patches.label), std::move(patches.normal)};
}

double partition_cost(const Surface& surface, const Partition& partition) {
  double sum = 0, area = 0;
  for (size_t f = 0; f < surface.faces.size(); ++f) {
    if (partition.label[f] < 0) continue;
    sum += surface.areas[f] * (surface.normals[f] - partition.normal[partition.label[f]]).squaredNorm();
    area += surface.areas[f];
  }
  return area > 0 ? sum / area : 0;
}

}  // namespace relief
