#include "planes.h"

#include <string.h>

#include "span_context.h"
#include "wavelet.h"

namespace relief {

RELIEF_COLD uint64_t decode_masks(RangeDecoder& coder, const Planes& planes, const Leaves& leaves) {
  planes.mask_models->init();
  uint64_t pixels = 0;
  for (uint32_t i = 0; i < planes.patch_count; i++) {
    const uint32_t w = planes.patches[i].width, h = planes.patches[i].height;
    const size_t stride = mask_stride(w);
    memset(planes.mask_buffer, 0, mask_buffer(w, h));
    uint8_t* const rows = planes.mask_buffer + kMaskAbove * stride + kMaskBefore;
    code_mask(coder, *planes.mask_models, rows, w, h, stride);
    const Pyramid p = pyramid_of(w, h);
    uint8_t* const mask = planes.mask + planes.begin[i];
    for (uint32_t y = 0; y < h; y++) {
      const uint8_t* row = rows + y * stride;
      memcpy(mask + p.low[0].at(0, y), row, w);
      uint32_t sum = 0;
      for (uint32_t x = 0; x < w; x++) sum += row[x];
      pixels += sum;
    }
    build_masks(p, mask, planes.mask_scratch, leaves);
  }
  return pixels;
}

namespace {

// Codes one part of every patch, coarse to fine: the coarsest LL (kLevels) or the three bands of a level.
RELIEF_COLD bool decode_level(RangeDecoder& coder, const Planes& planes, int level, const Leaves& leaves) {
  CoefficientModels& models = *planes.coefficient_models;
  for (uint32_t i = 0; i < planes.patch_count; i++) {
    const Pyramid p = pyramid_of(planes.patches[i].width, planes.patches[i].height);
    int32_t* const q = planes.q + planes.begin[i];
    const uint8_t* const mask = planes.mask + planes.begin[i];
    if (level == kLevels) {
      if (!code_low(coder, models, p, q, mask)) return false;
      continue;
    }
    for (int type = 0; type < 3; type++)
      if (!code_band(coder, models, p, q, mask, level, type, leaves)) return false;
  }
  return true;
}

BiskPlanes bisk_planes(const Planes& p) {
  return {p.patches, p.patch_count, p.begin, p.mask, p.q, p.bisk_state, p.bisk_patches, p.bisk_sets};
}

}  // namespace

void decode_coefficients(RangeDecoder& coder, const Planes& planes, const Leaves& leaves) {
  if (planes.bisk_state) {
    const BiskPlanes bisk = bisk_planes(planes);
    start_bisk(bisk);
    continue_bisk(coder, bisk);
    return;
  }
  planes.coefficient_models->init();
  for (int level = kLevels; level >= planes.level; level--)
    if (!decode_level(coder, planes, level, leaves)) return;
}

}  // namespace relief
