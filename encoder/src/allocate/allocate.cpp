#include "allocate/allocate.h"

#include <algorithm>
#include <cmath>

#include "code/quantise.h"
#include "code/range_encoder.h"
#include "fit/least_squares.h"
#include "resample/clean_mask.h"
#include "resample/extend_border.h"
#include "resample/punch_holes.h"
#include "surface/largest_first.h"

namespace relief {
namespace {

// Error between patches over error inside, per area: closing gaps costs accuracy (ledger of the design).
constexpr double kGapFactor = 5;
constexpr double kBendShare = 0.18;  // triangles over a gap follow part of the bend
constexpr double kMaskBitsPerNode = 3.4, kTableBits = 64;
// What a vertex is worth in bits to those who decode, draw and keep it. Bytes hardly change with the spacing
// around their least: this takes a sixth of the vertices, a third at fine targets, for as many bytes.
constexpr double kPixelBits = 0.085;
constexpr int kFinest = 40, kLeastFinest = 14, kStride = 2;
// The spacing that most patches end up with, over the lattice's diagonal, is about that times a power of
// lambda over the diagonal's fourth power: on scans of all kinds within 20%.
constexpr double kUsualSpacing = 3, kUsualSpacingSlope = 0.235;
constexpr double kMuchWorse = 1.02;  // costs: one stride farther will not be better
constexpr size_t kFewPixels = 6;
// No map has many more pixels than this, for each face and beyond: finer than what the faces hold gains
// nothing.
constexpr double kPixelsPerFace = 32, kPixelsBeyond = 1024;

// Cuts the rectangle down to the mask.
ElevationMap crop(const ElevationMap& map) {
  uint32_t x0 = map.width, x1 = 0, y0 = map.height, y1 = 0;
  for (uint32_t y = 0; y < map.height; y++)
    for (uint32_t x = 0; x < map.width; x++)
      if (map.mask[size_t(y) * map.width + x]) {
        x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
      }
  ElevationMap out;
  out.spacing = map.spacing;
  out.x0 = map.x0 + int32_t(x0), out.y0 = map.y0 + int32_t(y0), out.z0 = map.z0;
  out.pixels = map.pixels;
  out.width = x1 - x0 + 1, out.height = y1 - y0 + 1;
  for (uint32_t y = y0; y <= y1; y++) {
    const size_t i = size_t(y) * map.width;
    out.mask.insert(out.mask.end(), map.mask.begin() + ptrdiff_t(i + x0),
                    map.mask.begin() + ptrdiff_t(i + x1 + 1));
    out.z.insert(out.z.end(), map.z.begin() + ptrdiff_t(i + x0), map.z.begin() + ptrdiff_t(i + x1 + 1));
    out.face.insert(out.face.end(), map.face.begin() + ptrdiff_t(i + x0),
                    map.face.begin() + ptrdiff_t(i + x1 + 1));
  }
  return out;
}

// The finest resolution that is tried.
int finest_resolution(const AllocationInput& in, size_t patch) {
  double area = 0;
  for (int f : in.patches[patch].own) area += in.surface.areas[size_t(f)];
  const double pixels = kPixelsPerFace * double(in.patches[patch].own.size()) + kPixelsBeyond;
  if (area <= 0) return kLeastFinest;
  const double spacing = std::sqrt(area / pixels);
  return std::clamp(int(std::lround(4 * std::log2(in.spacing / spacing))), kLeastFinest, kFinest);
}

// What it costs to leave a patch away: its area at the distance of its size.
double whole_loss(const AllocationInput& in, size_t patch) {
  Vec3 lo = Vec3::Constant(INFINITY), hi = -lo;
  double area = 0;
  for (int f : in.patches[patch].own) {
    area += in.surface.areas[size_t(f)];
    for (int v : in.surface.faces[size_t(f)]) {
      lo = lo.cwiseMin(in.surface.vertices[size_t(v)]);
      hi = hi.cwiseMax(in.surface.vertices[size_t(v)]);
    }
  }
  return area * (hi - lo).squaredNorm() / 12;
}

std::unique_ptr<Candidate> make_candidate(const AllocationInput& in, const PatchSampler& sampler,
                                          size_t patch, int resolution) {
  auto c = std::make_unique<Candidate>();
  c->distortion.lost = whole_loss(in, patch);
  const double spacing = in.spacing * quarter_power(-resolution);
  FineRaster fine;
  ElevationMap map = sampler.sample(spacing, fine);
  if (map.pixels) extend_border(map, fine, in.from_border);
  smooth_border(map, fine);
  if (map.pixels) clean_mask(map, fine);
  if (map.pixels) cut_cliffs(map, in.patches[patch].frame, in.distance);
  drop_islands(map);
  punch_holes(map, in.patches[patch]);
  if (!map.pixels) return c;
  if (in.fit) fit_elevations(map, fine);
  c->distortion = sampling_distortion(map, fine);
  c->map = crop(map);
  c->boundary_nodes = count_boundary_nodes(c->map.mask.data(), c->map.width, c->map.height);
  c->image = forward_wavelet(c->map.width, c->map.height, c->map.mask.data(), c->map.z.data());
  return c;
}

// Bits of a patch's coefficients and the squared error of their quantisation, estimated.
double code_image(CountingCoder& coder, CoefficientModels& models, const WaveletImage& image, float step) {
  std::vector<int32_t> q(image.pyramid.size, 0);
  quantise_low(image, step, q.data());
  code_low(coder, models, image.pyramid, q.data(), image.mask.data());
  double squared = 0;
  for (int level = kLevels - 1; level >= 0; level--)
    for (int type = 0; type < 3; type++)
      squared += estimate_band(coder, models, image, level, type, step, float(kTrade), q.data());
  return squared;
}

double step_for(double lambda, double spacing) { return std::sqrt(lambda / kTrade) / spacing; }

// The resolution that suits most patches.
int usual_resolution(double lambda, double coarsest_spacing) {
  const double spacing =
      kUsualSpacing * kLatticeDiagonal * std::pow(lambda / std::pow(kLatticeDiagonal, 4), kUsualSpacingSlope);
  return std::clamp(int(std::lround(4 * std::log2(coarsest_spacing / spacing))), 0, kFinest);
}

}  // namespace

Allocator::Allocator(const AllocationInput& input) : in_(input), made_(input.patches.size()) {
  // the largest patch of each component must not vanish
  std::vector<size_t> largest(in_.surface.component_area.size(), SIZE_MAX);
  for (size_t p = 0; p < in_.patches.size(); p++) {
    if (in_.patches[p].own.empty()) continue;
    size_t& best = largest[size_t(in_.surface.component[size_t(in_.patches[p].own[0])])];
    if (best == SIZE_MAX || in_.patches[p].own.size() > in_.patches[best].own.size()) best = p;
  }
  must_live_.assign(in_.patches.size(), 0);
  for (size_t p : largest)
    if (p != SIZE_MAX) must_live_[p] = 1;
}

template <class Visit>
void Allocator::for_each_patch(Visit visit) const {
  largest_first(
      in_.patches.size(), [&](size_t p) { return in_.patches[p].own.size(); }, visit);
}

// A thread tries one patch after the other. What is returned lasts until the next call on this thread, which
// any waiting for other tasks may bring.
const PatchSampler& Allocator::sampler_of(size_t patch) {
  LastSampler& last = samplers_.local();
  if (!last.sampler || last.patch != patch)
    last = {patch, std::make_unique<PatchSampler>(in_.surface, in_.ownership, in_.patches, patch)};
  return *last.sampler;
}

const Candidate& Allocator::candidate(size_t patch, int resolution) {
  auto& made = made_[patch][resolution];
  if (!made) made = make_candidate(in_, sampler_of(patch), patch, resolution);
  return *made;
}

double Allocator::cost(size_t patch, int resolution, double lambda) {
  const Candidate& c = candidate(patch, resolution);
  const Distortion& d = c.distortion;
  if (c.empty()) return must_live_[patch] ? INFINITY : d.lost;
  CountingCoder coder;
  CoefficientModels models = *models_;
  const double spacing = c.map.spacing;
  const double squared = code_image(coder, models, c.image, float(step_for(lambda, spacing)));
  const double quantisation = squared * spacing * spacing * d.facing;
  const double inside = d.squared + quantisation;
  const double gap = d.area > 0 ? kGapFactor * d.gap_area * inside / d.area : 0;
  return inside + gap + kBendShare * d.bend + d.lost +
         lambda * (coder.bits() + kMaskBitsPerNode * c.boundary_nodes + kTableBits +
                   kPixelBits * double(c.map.pixels));
}

// Contexts as they are after the whole model at the present resolutions.
void Allocator::train(double lambda) {
  if (start_.empty())
    for (size_t p = 0; p < in_.patches.size(); p++)
      start_.push_back(std::min(usual_resolution(lambda, in_.spacing), finest_resolution(in_, p)));
  for_each_patch([&](size_t p) { candidate(p, start_[p]); });
  auto models = std::make_unique<CoefficientModels>();
  models->init();
  CountingCoder coder;
  for (size_t p = 0; p < in_.patches.size(); p++) {
    const Candidate& c = candidate(p, start_[p]);
    if (!c.empty()) code_image(coder, *models, c.image, float(step_for(lambda, c.map.spacing)));
  }
  models_ = std::move(models);
}

// No patch is more than an octave coarser than the middle of the surface: the gaps along it would be wide,
// and the decoder's search for partners would look far.
int Allocator::coarsest_resolution() const {
  std::vector<std::pair<int, double>> area;
  double total = 0;
  for (size_t p = 0; p < in_.patches.size(); p++) {
    double a = 0;
    for (int f : in_.patches[p].own) a += in_.surface.areas[f];
    area.push_back({start_[p], a});
    total += a;
  }
  std::sort(area.begin(), area.end());
  double sum = 0;
  for (auto& [k, a] : area)
    if ((sum += a) >= total / 2) return std::max(0, k - 4 - kStride);
  return 0;
}

Allocator::Choice Allocator::choose(double lambda) {
  train(lambda);
  const int coarsest = coarsest_resolution();
  for_each_patch([&](size_t p) {
    const int finest = finest_resolution(in_, p);
    int best = start_[p];
    double least = cost(p, best, lambda);
    while (candidate(p, best).empty() && best + kStride <= finest) {
      best += kStride;
      least = cost(p, best, lambda);
    }
    auto cost_at = [&](int k) { return k < coarsest || k > finest ? INFINITY : cost(p, k, lambda); };
    auto take_if_better = [&](int k, double c) {
      if (c < least) best = k, least = c;
      return best == k;
    };
    // down the valley on both sides, over small bumps of one stride where that is cheap, coarser, and finer
    // than all that loses much; then half a stride aside
    auto loses = [&](int k) { return k <= finest && candidate(p, k).distortion.lost > least / 2; };
    for (int direction : {-kStride, kStride})
      for (int k = best, misses = 0; misses < 2 || (direction > 0 && loses(k));) {
        const double c = cost_at(k += direction);
        misses = take_if_better(k, c) ? 0 : misses + (direction > 0 || c > kMuchWorse * least ? 2 : 1);
      }
    for (int k : {best - 1, best + 1})
      if (take_if_better(k, cost_at(k))) break;
    start_[p] = best;
  });
  Choice choice;
  choice.step = step_for(lambda, in_.spacing);
  for (size_t p = 0; p < in_.patches.size(); p++)
    choice.resolution.push_back(candidate(p, start_[p]).empty() ? kDropped : start_[p]);
  keep_one(choice);
  return choice;
}

// However few bytes are wanted, something of the surface is coded: its largest patch.
void Allocator::keep_one(Choice& choice) {
  size_t largest = 0;
  for (size_t p = 0; p < in_.patches.size(); p++) {
    if (choice.resolution[p] != kDropped) return;
    if (in_.patches[p].own.size() > in_.patches[largest].own.size()) largest = p;
  }
  int k = start_[largest];
  while (candidate(largest, k).empty() && k < kFinest) k++;
  if (!candidate(largest, k).empty()) choice.resolution[largest] = k;
}

Allocator::Choice Allocator::fixed(double lambda, double mu) {
  Choice choice;
  choice.step = step_for(lambda, in_.spacing);
  choice.resolution.resize(in_.patches.size());
  for_each_patch([&](size_t p) {
    // as many pixels as vertices: the patch's area over its plane by its vertices, half as many as its faces
    const PatchFaces& patch = in_.patches[p];
    const Vec3 n(patch.frame.n[0], patch.frame.n[1], patch.frame.n[2]);
    double area = 0;
    for (int f : patch.own) area += in_.surface.areas[f] * std::max(0.0, in_.surface.normals[f].dot(n));
    const double spacing = mu * std::sqrt(area / (0.5 * double(patch.own.size())));
    int k = spacing > 0 ? int(std::lround(4 * std::log2(in_.spacing / spacing))) : kFinest;
    k = std::clamp(k, 0, kFinest);
    while (candidate(p, k).map.pixels < kFewPixels && must_live_[p] && k < kFinest) k++;
    choice.resolution[p] = candidate(p, k).empty() ? kDropped : k;
  });
  return choice;
}

std::vector<CodedPatch> Allocator::coded(const Choice& choice, double& spacing, double& step,
                                         std::vector<int>& patch_number) {
  int coarsest = kFinest;
  for (int k : choice.resolution)
    if (k != kDropped) coarsest = std::min(coarsest, k);
  spacing = in_.spacing * quarter_power(-coarsest);
  step = std::clamp(choice.step * quarter_power(coarsest), kLeastStep, kMostStep);
  std::vector<CodedPatch> coded;
  patch_number.assign(in_.patches.size(), -1);
  for (size_t p = 0; p < in_.patches.size(); p++) {
    if (choice.resolution[p] == kDropped) continue;
    const Candidate& c = candidate(p, choice.resolution[p]);
    const int k = choice.resolution[p] - coarsest;
    patch_number[p] = int(coded.size());
    // step * spacing is the same everywhere: so is the gain in distortion for a bit
    coded.push_back({{c.map.width, c.map.height, c.map.x0, c.map.y0, c.map.z0, in_.patches[p].u,
                      in_.patches[p].v, k, std::min(k, int(kMaxStepIndex))},
                     c.map.mask.data(),
                     &c.image,
                     c.map.z.data(),
                     c.map.face.data()});
  }
  return coded;
}

}  // namespace relief
