#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <set>

#include "seams/handles.h"
#include "surface/sets.h"

namespace relief {
namespace {

constexpr double kErrorScore = 0.05;  // spacings to the fourth that weigh as much as a pixel
constexpr double kFoldScore = 8;
constexpr int kVainRounds = 2;  // without getting better
constexpr size_t kFewFolds = 8;
constexpr int kHeldRounds = 4;     // then pixels that were put back are tried again: others are gone by then
constexpr int kNeedfulRounds = 2;  // after those, for what must not stay
constexpr double kCoincidentScore = 1000;
constexpr double kAround = 2.5;  // spacings; so far around a pixel triangles change without it

// Pixels near one another that are taken out, and how bad the triangles around them were with them.
struct Cluster {
  std::vector<Pixel> pixels;  // of the patches as they were
  std::vector<Vec3> places;
  double reach = 0;
  double score = 0;
};

// How bad a mesh is, place by place.
class Faults {
 public:
  Faults(const SeamContext& in, const Attempt& a, const GapError& error, const std::vector<Fold>& folds,
         double unit) {
    const TriangleMesh& m = a.decoded.mesh;
    auto at = [&](uint32_t v) { return in.ground.lattice(m.positions[v]); };
    const size_t first = a.decoded.patch_triangles();
    for (size_t t = 0; t < error.triangle.size(); t++) {
      const auto& [x, y, z] = m.triangles[first + t];
      places_.push_back((at(x) + at(y) + at(z)) / 3);
      scores_.push_back(error.triangle[t].squared * error.triangle[t].area / unit);
    }
    for (const Fold& f : folds) {
      places_.push_back((at(f.end[0]) + at(f.end[1])) / 2);
      scores_.push_back(kFoldScore);
    }
  }

  double around(const Cluster& c) const {
    double sum = 0;
    for (size_t i = 0; i < places_.size(); i++)
      if (std::any_of(c.places.begin(), c.places.end(),
                      [&](const Vec3& p) { return (p - places_[i]).squaredNorm() < c.reach * c.reach; }))
        sum += scores_[i];
    return sum;
  }

 private:
  std::vector<Vec3> places_;
  std::vector<double> scores_;
};

std::vector<Cluster> clusters_of(const SeamContext& in, const std::vector<uint32_t>& pixels,
                                 const MaskEdits& edits) {
  std::vector<Vec3> place;
  for (uint32_t v : pixels) place.push_back(in.ground.lattice(in.plain.mesh.positions[v]));
  auto reach = [&](size_t i) { return kAround * in.ground.spacing[pixels[i]]; };
  Sets sets(pixels.size());
  for (size_t i = 0; i < pixels.size(); i++)
    for (size_t k = 0; k < i; k++)
      if ((place[i] - place[k]).norm() < std::max(reach(i), reach(k))) sets.join(uint32_t(i), uint32_t(k));
  std::vector<Cluster> clusters;
  std::vector<int> number(pixels.size(), -1);
  for (size_t i = 0; i < pixels.size(); i++) {
    int& n = number[sets.find(uint32_t(i))];
    if (n < 0) n = int(clusters.size()), clusters.emplace_back();
    Cluster& c = clusters[size_t(n)];
    c.pixels.push_back(edits.whole_pixel(in.ground.pixel[pixels[i]]));
    c.places.push_back(place[i]);
    c.reach = std::max(c.reach, reach(i));
  }
  return clusters;
}

// Forgets the images that none of these patches has.
void keep_images(std::initializer_list<const std::vector<CodedPatch>*> lists,
                 std::list<CleanedPatch>& storage, QuantisedImages& quantised, MeshedPatches& meshed) {
  std::set<const WaveletImage*> used;
  for (const auto* patches : lists)
    for (const CodedPatch& p : *patches) used.insert(p.image);
  quantised.keep(used);
  meshed.keep(used);
  storage.remove_if([&](const CleanedPatch& c) { return used.count(&c.image) == 0; });
}

// What patches are decoded to. Nothing is written of them unless their coder cuts it.
struct Look {
  StreamParts parts;
  std::optional<SeamContext> context;

  Look(const std::vector<CodedPatch>& patches, const StreamPlacement& placement, const SeamsInput& input,
       QuantisedImages& quantised, MeshedPatches& meshed) {
    if (placement.bisk) {
      parts = code_stream(patches, placement, quantised);
      context.emplace(parts, decoded_patches(parts), patches, input);
      return;
    }
    parts.placement = placement;
    quantise(patches, placement, quantised);
    PatchDecoder decoder(meshed.of(patches, placement, quantised), placement);
    tbb::parallel_invoke([&] { context.emplace(parts, std::move(decoder), patches, input); },
                         [&] { learn(patches, placement, quantised); });
  }
};

}  // namespace

bool mend_masks(std::vector<CodedPatch>& patches, const StreamPlacement& placement, const SeamsInput& input,
                const MendRounds& most, std::vector<int>& patch_number, std::list<CleanedPatch>& storage,
                QuantisedImages& quantised) {
  struct State {
    std::vector<CodedPatch> patches;
    std::vector<int> number;
    double score;
    size_t folds;
  } best = {{}, {}, INFINITY, 0};
  const double unit = kErrorScore * std::pow(double(placement.spacing), 4);
  MaskEdits edits(patches, storage);
  MaskFaults faults;
  MeshedPatches meshed;
  std::vector<Cluster> taken;  // in the round before
  int more = 0;
  for (int round = 0, vain = 0, last = 0; last <= kNeedfulRounds; round++) {
    const bool needful = round >= most.rounds + more || vain > kVainRounds;
    last += needful;
    const Look look(edits.patches(), placement, input, quantised, meshed);
    const SeamContext& in = *look.context;
    const std::vector<uint32_t> dropped = wrong_links(in.plain, in.ground, in.known.links);
    const Pieces pieces = pieces_of(in, dropped);
    Attempt a = with_links(in, dropped, pieces);
    add_handles(in, a);
    const double lost_before = faults.lost;
    GapError error;
    std::vector<Fold> folds;
    tbb::parallel_invoke([&] { error = error_of(in, a); },
                         [&] { folds = FoldFinder(in.plain, in.ground, in.folded).find(a.decoded); });
    more = folds.size() > kFewFolds ? most.for_folds : 0;
    const UnwantedPixels unwanted = unwanted_pixels(a.decoded, in.ground, pieces, error, folds, faults);
    const double count = double(unwanted.needful.size() + (needful ? 0 : unwanted.wished.size()));
    const double score = 10 * a.mismatch + kFoldScore * double(folds.size()) + count +
                         kCoincidentScore * faults.coincident + (error.sum + lost_before) / unit;
    if (score < best.score)
      best = {edits.patches(), edits.number(), score, folds.size()}, vain = 0;
    else
      vain++;
    const Faults now(in, a, error, folds, unit);
    for (const Cluster& c : taken)
      if (now.around(c) > c.score)
        for (const Pixel& p : c.pixels) edits.put_back(p);
    if (round % kHeldRounds == kHeldRounds - 1) edits.release();
    std::vector<uint32_t> wished;
    for (uint32_t v : unwanted.wished)
      if (!needful && !edits.is_held(edits.whole_pixel(in.ground.pixel[v]))) wished.push_back(v);
    taken = clusters_of(in, wished, edits);
    for (Cluster& c : taken) c.score = now.around(c);
    for (uint32_t v : wished) edits.take_out(edits.whole_pixel(in.ground.pixel[v]));
    for (uint32_t v : unwanted.needful) edits.take_out(edits.whole_pixel(in.ground.pixel[v]));
    if (!edits.apply()) break;
    keep_images({&edits.whole(), &edits.patches(), &best.patches}, storage, quantised, meshed);
  }
  for (int& n : patch_number)
    if (n >= 0) n = best.number[size_t(n)];
  patches = std::move(best.patches);
  keep_images({&patches}, storage, quantised, meshed);
  return best.folds <= kFewFolds || most.for_folds > 0;
}

}  // namespace relief
