// The stream's header and patch table: parsed, checked against each other and against the limits.
#pragma once
#include "format.h"
#include "range_decoder.h"

namespace relief {

// What the patch table asks for, summed up.
struct Totals {
  uint64_t pixels = 0;                     // of all rectangles
  uint64_t low_pixels = 0;                 // of all rectangles, at the level that is decoded
  uint64_t planes = 0;                     // elements of all pyramids
  uint64_t coded = 0;                      // of those, of planes that are coded
  uint64_t scratch = 0;                    // floats of the largest patch's wavelet_scratch
  uint32_t max_width = 0, max_height = 0;  // of any patch
  uint64_t max_pixels = 0;                 // of any patch
  uint64_t max_mask = 0;                   // bytes of the largest mask buffer
};

struct Parsed {
  int level = 0;  // that is decoded
  StreamHeader header;
  Totals totals;
  size_t table_begin, coefficients_begin;  // offsets of the parts
  size_t table_bytes;                      // of table and masks that are here
  size_t coefficient_bytes;                // that are here
  bool cut;                                // the bytes end before the colours
  size_t colours_begin, colour_bytes;      // what is here of all channels
  // Whether the bytes end before the masks do.
  bool masks_cut() const { return table_bytes < header.table_bytes; }
};

// Reads a little-endian base-128 number of at most 5 bytes.
bool read_varint(const uint8_t*& p, const uint8_t* end, uint32_t& value);

// Reads the header and checks it. Everything but the patch table.
relief_status parse_header(const void* data, size_t size, const relief_limits& limits, Parsed& parsed);

// Where the patch table begins, and the masks behind it.
inline RangeDecoder table_coder(const void* data, const Parsed& parsed) {
  return {static_cast<const uint8_t*>(data) + parsed.table_begin, parsed.table_bytes, parsed.masks_cut()};
}

// Decodes the patch table from `coder` into `patches` (null: only sums up).
relief_status parse_table(RangeDecoder& coder, const relief_limits& limits, Parsed& parsed,
                          PatchHeader* patches);

// More than the bytes that decoding with any options takes, workspace and output, by a formula that any
// decoder can state (bitstream.md, section 14).
uint64_t memory_bound(const Parsed& parsed);

// What limits.max_memory allows a stream of so many bytes.
uint64_t memory_allowed(const relief_limits& limits, size_t size);

// How far a mask's buffer reaches around the mask: see code_mask.
constexpr size_t kMaskBefore = 4, kMaskAbove = 3;
constexpr size_t mask_stride(size_t w) { return w + 2 * kMaskBefore; }
constexpr size_t mask_buffer(size_t w, size_t h) { return mask_stride(w) * (h + kMaskAbove); }

}  // namespace relief
