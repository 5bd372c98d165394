#include "partition/partition.h"

#include <algorithm>
#include <cmath>

#include "partition/boundary_shape.h"
#include "partition/connected.h"
#include "partition/gla.h"
#include "partition/label_diffusion.h"
#include "partition/merge.h"
#include "partition/normal_cone.h"
#include "partition/overlap.h"

namespace relief {
namespace {

constexpr double kBoundarySlack = 4;    // degrees; how far beyond the aperture a smoother boundary may reach
constexpr double kWidestAperture = 88;  // degrees; with the slack
constexpr int kDiffusionRounds = 3, kDiffusionSteps = 24;
constexpr int kMostRounds = 10;

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

}  // namespace

Partition partition_gla(const Surface& surface, const PartitionOptions& options) {
  const auto progress = [&](double done) {
    if (options.progress) options.progress(done);
  };
  const double spacing = options.spacing > 0
                             ? options.spacing
                             : std::sqrt(surface.total_area / static_cast<double>(surface.vertices.size()));
  const NormalCone cone = make_normal_cone(surface, options.aperture);
  const double widest =
      std::max(options.aperture, std::min(options.aperture + kBoundarySlack, kWidestAperture));
  const double epsilon = std::cos(widest * M_PI / 180);
  NormalCone relaxed = cone;
  relaxed.cosine = epsilon;

  Patches patches = generalized_lloyd(cone, surface, [&](double done) { progress(0.7 * done); });
  merge_patches(cone, surface, patches, {});
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
  progress(1);
  return {std::move(patches.label), std::move(patches.normal)};
}

}  // namespace relief
