#include "code/ledger.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "bisk_decoder.h"
#include "code/range_encoder.h"
#include "container.h"
#include "mask.h"
#include "relief/encoder.h"
#include "span_context.h"
#include "wavelet.h"

namespace relief {
namespace {

// Decodes and adds up what every bit cost.
class CountingDecoder {
 public:
  static constexpr bool kEncoding = false;
  explicit CountingDecoder(const RangeDecoder& coder) : coder_(coder) {}
  int code(int bit, uint32_t p16) {
    bit = coder_.code(bit, p16);
    bits_ += bit_cost(bit, p16);
    return bit;
  }
  bool exhausted() const { return coder_.exhausted(); }
  size_t left() const { return coder_.left(); }
  double take() {
    const double b = bits_;
    bits_ = 0;
    return b;
  }

 private:
  RangeDecoder coder_;
  double bits_ = 0;
};

struct PatchPlanes {
  Pyramid pyramid;
  std::vector<uint8_t> mask;
  std::vector<int32_t> q;
};

PatchPlanes read_mask(CountingDecoder& coder, MaskModels& models, const PatchHeader& patch,
                      uint32_t& pixels) {
  const size_t stride = mask_stride(patch.width);
  std::vector<uint8_t> buffer(mask_buffer(patch.width, patch.height), 0);
  uint8_t* const rows = buffer.data() + kMaskAbove * stride + kMaskBefore;
  code_mask(coder, models, rows, patch.width, patch.height, stride);
  PatchPlanes p;
  p.pyramid = pyramid_of(patch.width, patch.height);
  p.mask.assign(p.pyramid.size, 0);
  p.q.assign(p.pyramid.size, 0);
  pixels = 0;
  for (uint32_t y = 0; y < patch.height; y++)
    for (uint32_t x = 0; x < patch.width; x++) {
      pixels += rows[y * stride + x];
      p.mask[p.pyramid.low[0].at(x, y)] = rows[y * stride + x];
    }
  std::vector<uint8_t> scratch(2 * size_t(patch.width) * patch.height + 8 * size_t(patch.width) + 64);
  build_masks(p.pyramid, p.mask.data(), scratch.data());
  return p;
}

// Of one level: bits of each patch's sub-bands.
using LevelBits = std::vector<std::array<double, Ledger::kBands>>;

// The coarsest level first.
std::vector<LevelBits> coefficient_bits(CountingDecoder& coder, std::vector<PatchPlanes>& planes) {
  const auto models = std::make_unique<CoefficientModels>();
  models->init();
  std::vector<LevelBits> bits(kLevels, LevelBits(planes.size()));
  for (size_t i = 0; i < planes.size(); i++) {
    code_low(coder, *models, planes[i].pyramid, planes[i].q.data(), planes[i].mask.data());
    bits[0][i][0] = coder.take();
  }
  for (int level = kLevels - 1; level >= 0; level--)
    for (size_t i = 0; i < planes.size(); i++)
      for (int type = 0; type < 3; type++) {
        code_band(coder, *models, planes[i].pyramid, planes[i].q.data(), planes[i].mask.data(), level, type);
        bits[size_t(kLevels - 1 - level)][i][size_t(type) + 1] = coder.take();
      }
  return bits;
}

// Whole bytes for each share of the bits: differences of rounded sums, so that they add up to `bytes`.
std::vector<uint64_t> bytes_of(const std::vector<double>& bits, uint64_t bytes) {
  double total = 0, sum = 0;
  for (double b : bits) total += b;
  std::vector<uint64_t> shares;
  uint64_t last = 0;
  for (double b : bits) {
    sum += b;
    const uint64_t upto = total > 0 ? uint64_t(std::lround(double(bytes) * (sum / total))) : 0;
    shares.push_back(upto - last);
    last = upto;
  }
  if (!shares.empty()) shares.back() += bytes - last;  // nothing was coded: what is left is the coder's end
  return shares;
}

void add_patches(const std::vector<double>& bits, Ledger& ledger) {
  const std::vector<uint64_t> by_patch = bytes_of(bits, ledger.coefficients);
  for (size_t i = 0; i < by_patch.size(); i++) ledger.patches[i].coefficients = by_patch[i];
}

// Of bisk: by bit plane and by patch.
void add_bisk(CountingDecoder& coder, const std::vector<PatchHeader>& headers,
              const std::vector<PatchPlanes>& patches, size_t pixels, Ledger& ledger) {
  std::vector<uint8_t> mask;
  std::vector<PlanesBegin> begin;
  for (const PatchPlanes& p : patches) {
    begin.push_back({mask.size(), mask.size(), 0});
    mask.insert(mask.end(), p.mask.begin(), p.mask.end());
  }
  std::vector<int32_t> q(mask.size(), 0);
  BiskState state;
  std::vector<BiskPatch> at(patches.size());
  std::vector<BiskSet> sets(pixels);
  const BiskPlanes planes = {
      headers.data(), uint32_t(headers.size()), begin.data(), mask.data(), q.data(), &state, at.data(),
      sets.data()};
  start_bisk(planes);
  std::vector<double> of_plane(kMostPlanes, 0), of_patch(patches.size(), 0);
  size_t highest = 0;
  for (bool more = true; more;) {
    const uint32_t patch = state.patch;
    const int8_t before = at[patch].plane;
    more = advance_bisk(coder, planes);
    const size_t plane = size_t(std::max<int8_t>({before, at[patch].plane, 0}));
    const double bits = coder.take();
    highest = std::max(highest, plane);
    of_plane[kMostPlanes - 1 - plane] += bits;
    of_patch[patch] += bits;
  }
  of_plane.erase(of_plane.begin(), of_plane.end() - ptrdiff_t(highest) - 1);
  ledger.by_plane = bytes_of(of_plane, ledger.coefficients);
  add_patches(of_patch, ledger);
}

void add_coefficients(const std::vector<LevelBits>& bits, Ledger& ledger) {
  std::vector<double> bands, patches(ledger.patches.size(), 0);
  for (const LevelBits& level : bits)
    for (size_t band = 0; band < Ledger::kBands; band++) {
      bands.push_back(0);
      for (size_t i = 0; i < level.size(); i++) bands.back() += level[i][band], patches[i] += level[i][band];
    }
  const std::vector<uint64_t> by_band = bytes_of(bands, ledger.coefficients);
  for (size_t level = 0; level < bits.size(); level++) {
    std::array<uint64_t, Ledger::kBands>& of = ledger.by_band.emplace_back();
    std::copy_n(by_band.begin() + ptrdiff_t(level * Ledger::kBands), Ledger::kBands, of.begin());
    ledger.by_level.push_back(std::accumulate(of.begin(), of.end(), uint64_t(0)));
  }
  add_patches(patches, ledger);
}

}  // namespace

Ledger read_ledger(const std::vector<uint8_t>& stream) {
  auto check = [](relief_status status) {
    if (status != RELIEF_OK) throw InputError(relief_status_text(status));
  };
  const relief_limits& limits = relief_default_limits;
  Parsed parsed;
  check(parse_header(stream.data(), stream.size(), limits, parsed));
  const StreamHeader& h = parsed.header;
  std::vector<PatchHeader> patches(h.patch_count);
  RangeDecoder table(stream.data() + parsed.table_begin, h.table_bytes, false);
  check(parse_table(table, limits, parsed, patches.data()));
  const auto& colours = h.colour_bytes;
  if (parsed.cut || parsed.colour_bytes < std::accumulate(colours, colours + kChannels, size_t(0)))
    throw InputError("the stream is not whole");

  Ledger ledger;
  CountingDecoder masks(table);
  const auto models = std::make_unique<MaskModels>();
  models->init();
  std::vector<PatchPlanes> planes;
  std::vector<double> mask_bits;
  for (const PatchHeader& patch : patches) {
    Ledger::P p;
    planes.push_back(read_mask(masks, *models, patch, p.pixels));
    mask_bits.push_back(masks.take());
    p.width = patch.width, p.height = patch.height;
    p.spacing = double(spacing_of(h.spacing, patch)) * h.scale;
    const Frame f = frame_of(patch.u, patch.v);
    p.normal = {f.n[0], f.n[1], f.n[2]};
    ledger.patches.push_back(p);
  }
  ledger.coefficients = h.coefficient_bytes;
  const double all_masks = std::accumulate(mask_bits.begin(), mask_bits.end(), 0.0);
  ledger.masks = std::min<uint64_t>(h.table_bytes, uint64_t(std::lround(all_masks / 8)));
  const std::vector<uint64_t> by_patch = bytes_of(mask_bits, ledger.masks);
  for (size_t i = 0; i < by_patch.size(); i++) ledger.patches[i].masks = by_patch[i];
  ledger.side = h.table_bytes - ledger.masks;
  ledger.header = parsed.table_begin;
  ledger.seams = h.seam_bytes;
  ledger.colours = parsed.colour_bytes;

  RangeDecoder coder(stream.data() + parsed.coefficients_begin, h.coefficient_bytes, false);
  CountingDecoder counting(coder);
  if (h.flags & kFlagBisk)
    add_bisk(counting, patches, planes, h.mask_pixels, ledger);
  else
    add_coefficients(coefficient_bits(counting, planes), ledger);
  return ledger;
}

}  // namespace relief
