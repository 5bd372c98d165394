#include "planes.h"

#include <string.h>

#include "wavelet.h"

namespace relief {

RELIEF_COLD uint64_t decode_masks(RangeDecoder& coder, const Planes& planes, const Leaves& leaves) {
  planes.mask_models->init();
  PlanesBegin begin = {};
  for (uint32_t i = 0; i < planes.patch_count; i++) {
    const uint32_t w = planes.patches[i].width, h = planes.patches[i].height;
    const size_t stride = mask_stride(w);
    memset(planes.mask_buffer, 0, mask_buffer(w, h));
    uint8_t* const rows = planes.mask_buffer + kMaskAbove * stride + kMaskBefore;
    if (!coder.exhausted()) code_mask(coder, *planes.mask_models, rows, w, h, stride);
    if (coder.exhausted()) memset(planes.mask_buffer, 0, mask_buffer(w, h));
    const Pyramid p = pyramid_of(w, h);
    uint8_t* const mask = planes.mask + begin.mask;
    planes.begin[i] = begin;
    begin.mask += p.size, begin.q += p.coded;
    for (uint32_t y = 0; y < h; y++) {
      const uint8_t* row = rows + y * stride;
      memcpy(mask + p.low[0].at(0, y), row, w);
      uint32_t sum = 0;
      for (uint32_t x = 0; x < w; x++) sum += row[x];
      begin.pixels += sum;
    }
    build_masks(p, mask, planes.mask_scratch, leaves);
  }
  return begin.pixels;
}

namespace {

// Where decoding by subband is, and where it would go on from.
class SubbandCheckpoints {
 public:
  SubbandCheckpoints(const Planes& planes, const uint8_t* data, size_t size)
      : planes_(planes), state_(*planes.subband_state), data_(data), size_(size) {
    start = state_.start;
    set_due();
  }
  BandStart start;
  int level = 0, type = 0;
  uint32_t patch = 0;

  bool due(size_t left) const { return left < due_; }
  RELIEF_COLD void save(const RangeDecoder& coder, BandStart here) {
    state_.coder = coder.state(data_);
    state_.level = level, state_.type = type, state_.patch = patch, state_.start = here;
    state_.models = *planes_.coefficient_models;
    set_due();
  }

 private:
  // Keeping the models costs about as much as decoding thirty bytes.
  void set_due() {
    constexpr size_t kApart = 512;
    const size_t next = state_.coder.at + kApart;
    due_ = next < size_ ? size_ - next : 0;
  }
  const Planes& planes_;
  SubbandState& state_;
  const uint8_t* data_;
  size_t size_, due_ = 0;
};

// One part of a patch: the coarsest LL (kLevels) or a band of a level.
RELIEF_COLD bool decode_part(RangeDecoder& coder, const Planes& planes, SubbandCheckpoints& at,
                             const Leaves& leaves) {
  const PatchHeader& patch = planes.patches[at.patch];
  const Pyramid p = pyramid_of(patch.width, patch.height);
  int32_t* const q = planes.q + planes.begin[at.patch].q;
  const uint8_t* const mask = planes.mask + planes.begin[at.patch].mask;
  if (at.level < kLevels)
    return code_band<RangeDecoder, SubbandCheckpoints&>(coder, *planes.coefficient_models, p, q, mask,
                                                        at.level, at.type, leaves, at);
  if (at.due(coder.left())) at.save(coder, {});
  return code_low(coder, *planes.coefficient_models, p, q, mask);
}

// The three bands of a level follow one another in a patch.
RELIEF_COLD void continue_subband(const uint8_t* data, size_t size, bool cut, const Planes& planes,
                                  const Leaves& leaves) {
  const SubbandState& from = *planes.subband_state;
  SubbandCheckpoints at(planes, data, size);
  RangeDecoder coder(data, size, cut, from.coder);
  static_cast<LearnedModels&>(*planes.coefficient_models) = from.models;
  at.patch = from.patch, at.type = from.type;
  for (at.level = from.level; at.level >= planes.level; at.level--, at.patch = 0)
    for (; at.patch < planes.patch_count; at.patch++, at.type = 0)
      for (; at.type < (at.level == kLevels ? 1 : 3); at.type++, at.start = {})
        if (!decode_part(coder, planes, at, leaves)) return;
}

BiskPlanes bisk_planes(const Planes& p) {
  return {p.patches, p.patch_count, p.begin, p.mask, p.q, p.bisk_state, p.bisk_patches, p.bisk_sets};
}

}  // namespace

void start_coefficients(const Planes& planes) {
  if (planes.bisk_state) {
    start_bisk(bisk_planes(planes));
    return;
  }
  planes.coefficient_models->init();
  SubbandState& s = *planes.subband_state;
  s.coder = {};
  s.level = kLevels, s.type = 0;
  s.patch = 0, s.start = {};
  s.models = *planes.coefficient_models;
}

void continue_coefficients(const uint8_t* data, size_t size, bool cut, const Planes& planes,
                           const Leaves& leaves) {
  if (planes.bisk_state)
    continue_bisk(data, size, bisk_planes(planes));
  else
    continue_subband(data, size, cut, planes, leaves);
}

}  // namespace relief
