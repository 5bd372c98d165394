#include "container.h"

#include <string.h>

#include "gaps.h"
#include "patch_table.h"
#include "wavelet.h"

namespace relief {

bool read_varint(const uint8_t*& p, const uint8_t* end, uint32_t& value) {
  value = 0;
  for (int i = 0; i < 5; i++) {
    if (p == end) return false;
    const uint8_t b = *p++;
    if (i == 4 && b > 15) return false;
    value |= uint32_t(b & 127) << (7 * i);
    if (b < 128) return true;
  }
  return false;
}

namespace {

float read_float(const uint8_t* p) {
  const uint32_t bits = uint32_t(p[0]) | uint32_t(p[1]) << 8 | uint32_t(p[2]) << 16 | uint32_t(p[3]) << 24;
  float f;
  memcpy(&f, &bits, 4);
  return f;
}

bool within(float v, float lo, float hi) { return v >= lo && v <= hi; }  // false for NaN

}  // namespace

relief_status parse_header(const void* data, size_t size, const relief_limits& limits, Parsed& parsed) {
  const uint8_t *const begin = static_cast<const uint8_t*>(data), *const end = begin + size;
  const uint8_t* p = begin;
  StreamHeader& h = parsed.header;
  constexpr size_t kFixed = 3 + 1 + 1 + 6 * 4;
  for (size_t i = 0; i < 3 && i < size; i++)
    if (p[i] != "RLF"[i]) return RELIEF_ERROR_MAGIC;
  if (size > 3 && p[3] != RELIEF_STREAM_VERSION) return RELIEF_ERROR_VERSION;
  if (size < kFixed) return RELIEF_ERROR_TRUNCATED;
  h.flags = p[4];
  for (int i = 0; i < 3; i++) h.origin[i] = read_float(p + 5 + 4 * i);
  h.scale = read_float(p + 17);
  h.spacing = read_float(p + 21);
  h.step = read_float(p + 25);
  p += kFixed;
  uint32_t* const counts[] = {&h.patch_count,       &h.mask_pixels,     &h.boundary_nodes,
                              &h.vertex_count,      &h.triangle_count,  &h.table_bytes,
                              &h.coefficient_bytes, &h.seam_bytes,      &h.colour_step,
                              &h.colour_bytes[0],   &h.colour_bytes[1], &h.colour_bytes[2]};
  constexpr int kWithoutColours = 8;
  const bool coloured = h.flags & kFlagColoured;
  for (int i = 0; i < kWithoutColours + 1 + kChannels; i++) {
    *counts[i] = 0;
    if ((i < kWithoutColours || coloured) && !read_varint(p, end, *counts[i]))
      return p == end ? RELIEF_ERROR_TRUNCATED : RELIEF_ERROR_CORRUPT;
  }
  if (coloured && (h.colour_step < kLeastColourStep || h.colour_step > kMostColourStep))
    return RELIEF_ERROR_CORRUPT;
  // positions stay finite: |origin| + scale * limit < 2^127
  bool ok = (h.flags & ~uint32_t(kFlagClosed | kFlagBisk | kFlagColoured)) == 0 &&
            within(h.scale, 1e-30f, 1e30f) && within(h.spacing, 1.0f, float(1 << 20)) &&
            within(h.step, 1.0f / 64, float(1 << 20));
  for (float o : h.origin) ok = ok && within(o, -1e37f, 1e37f);
  ok = ok && h.patch_count > 0 && h.boundary_nodes <= h.mask_pixels && h.mask_pixels >= 3;
  if (!ok) return RELIEF_ERROR_CORRUPT;
  if (h.patch_count > limits.max_patches || h.mask_pixels > limits.max_pixels ||
      h.vertex_count > limits.max_vertices || h.mask_pixels > limits.max_vertices)
    return RELIEF_ERROR_LIMIT;
  // every patch costs at least a byte and a half of the table
  if (h.patch_count > h.table_bytes) return RELIEF_ERROR_CORRUPT;
  parsed.table_begin = size_t(p - begin);
  parsed.coefficients_begin = parsed.table_begin + h.table_bytes;
  const size_t here = size - parsed.table_begin;
  parsed.table_bytes = here < h.table_bytes ? here : h.table_bytes;
  const size_t left = here - parsed.table_bytes;
  uint64_t colour_bytes = 0;
  for (uint32_t b : h.colour_bytes) colour_bytes += b;
  const uint64_t surface_bytes = uint64_t(h.coefficient_bytes) + h.seam_bytes;
  if (left > surface_bytes + colour_bytes) return RELIEF_ERROR_CORRUPT;  // bytes too many
  parsed.cut = left < surface_bytes;
  parsed.coefficient_bytes = h.coefficient_bytes <= left ? h.coefficient_bytes : left;
  parsed.colours_begin = parsed.coefficients_begin + size_t(surface_bytes);
  parsed.colour_bytes = parsed.cut ? 0 : left - size_t(surface_bytes);
  return RELIEF_OK;
}

relief_status parse_table(RangeDecoder& coder, const relief_limits& limits, Parsed& parsed,
                          PatchHeader* patches) {
  PatchTableModels models;
  Totals& t = parsed.totals;
  t = Totals();
  for (uint32_t i = 0; i < parsed.header.patch_count; i++) {
    PatchHeader patch = {};
    const bool good = code_patch(coder, models, patch);
    if (coder.exhausted()) return RELIEF_ERROR_TRUNCATED;
    if (!good) return RELIEF_ERROR_CORRUPT;
    const uint64_t pixels = uint64_t(patch.width) * patch.height;
    const uint64_t mask = mask_buffer(patch.width, patch.height);
    const uint64_t scratch = wavelet_scratch(patch.width, patch.height);
    t.pixels += pixels;
    const Pyramid pyramid = pyramid_of(patch.width, patch.height);
    const Band& low = pyramid.low[parsed.level];
    t.low_pixels += uint64_t(low.width) * low.height;
    t.planes += pyramid.size;
    t.coded += pyramid.coded;
    // margins of the bands: some elements a patch beyond a multiple of the pixels
    if (t.pixels > limits.max_pixels || t.planes > uint64_t(limits.max_pixels) * 8 + uint64_t(i + 1) * 640)
      return RELIEF_ERROR_LIMIT;
    t.scratch = scratch > t.scratch ? scratch : t.scratch;
    t.max_width = patch.width > t.max_width ? patch.width : t.max_width;
    t.max_height = patch.height > t.max_height ? patch.height : t.max_height;
    t.max_pixels = pixels > t.max_pixels ? pixels : t.max_pixels;
    t.max_mask = mask > t.max_mask ? mask : t.max_mask;
    if (patches) patches[i] = patch;
  }
  if (parsed.header.mask_pixels > t.pixels) return RELIEF_ERROR_CORRUPT;
  return RELIEF_OK;
}

uint64_t memory_bound(const Parsed& parsed) {
  const StreamHeader& h = parsed.header;
  const Totals& t = parsed.totals;
  const uint64_t pixels = h.mask_pixels, nodes = h.boundary_nodes;
  uint64_t bytes = (1u << 23) + 320 * uint64_t(h.patch_count) + 5 * t.planes + 80 * t.max_pixels +
                   116 * pixels + 1200 * nodes;
  if (h.flags & kFlagColoured)
    bytes += (1u << 20) + 12 * t.planes + 6 * t.max_pixels + 4 * (pixels + gap_vertices(h.boundary_nodes));
  return bytes;
}

uint64_t memory_allowed(const relief_limits& limits, size_t size) {
  return limits.max_memory ? limits.max_memory : (uint64_t(1) << 30) + (uint64_t(size) << 16);
}

}  // namespace relief
