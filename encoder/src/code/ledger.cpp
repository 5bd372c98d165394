#include "code/ledger.h"

#include <cmath>
#include <memory>

#include "code/range_encoder.h"
#include "coefficients.h"
#include "container.h"
#include "mask.h"
#include "relief/encoder.h"
#include "wavelet.h"

namespace relief {
namespace {

// Decodes and adds up what every bit cost.
class CountingDecoder {
 public:
  static constexpr bool kEncoding = false;
  explicit CountingDecoder(RangeDecoder& coder) : coder_(coder) {}
  int code(int bit, uint32_t p16) {
    bit = coder_.code(bit, p16);
    bits_ += bit_cost(bit, p16);
    return bit;
  }
  bool exhausted() const { return coder_.exhausted(); }
  double take() {
    const double b = bits_;
    bits_ = 0;
    return b;
  }

 private:
  RangeDecoder& coder_;
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

std::vector<double> coefficient_bits(CountingDecoder& coder, std::vector<PatchPlanes>& planes) {
  const auto models = std::make_unique<CoefficientModels>();
  models->init();
  std::vector<double> bits;
  for (PatchPlanes& p : planes) code_low(coder, *models, p.pyramid, p.q.data(), p.mask.data());
  for (int level = kLevels - 1; level >= 0; level--) {
    for (PatchPlanes& p : planes)
      for (int type = 0; type < 3; type++)
        code_band(coder, *models, p.pyramid, p.q.data(), p.mask.data(), level, type);
    bits.push_back(coder.take());
  }
  return bits;
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
  if (parsed.cut) throw InputError("the stream is not whole");

  Ledger ledger;
  CountingDecoder masks(table);
  const auto models = std::make_unique<MaskModels>();
  models->init();
  std::vector<PatchPlanes> planes;
  for (const PatchHeader& patch : patches) {
    Ledger::P p;
    planes.push_back(read_mask(masks, *models, patch, p.pixels));
    p.width = patch.width, p.height = patch.height;
    p.spacing = double(spacing_of(h.spacing, patch)) * h.scale;
    const Frame f = frame_of(patch.u, patch.v);
    p.normal = {f.n[0], f.n[1], f.n[2]};
    ledger.patches.push_back(p);
  }
  ledger.coefficients = h.coefficient_bytes;
  ledger.masks = std::min<uint64_t>(h.table_bytes, uint64_t(std::lround(masks.take() / 8)));
  ledger.side = h.table_bytes - ledger.masks;
  ledger.header = parsed.table_begin;
  ledger.seams = h.seam_bytes;

  RangeDecoder coder(stream.data() + parsed.coefficients_begin, h.coefficient_bytes, false);
  CountingDecoder counting(coder);
  const std::vector<double> bits = coefficient_bits(counting, planes);
  double total = 0, sum = 0;
  for (double b : bits) total += b;
  uint64_t last = 0;  // rounded sums, so that the levels add up
  for (double b : bits) {
    sum += b;
    const uint64_t upto = total > 0 ? uint64_t(std::lround(double(h.coefficient_bytes) * sum / total)) : 0;
    ledger.by_level.push_back(upto - last);
    last = upto;
  }
  return ledger;
}

}  // namespace relief
