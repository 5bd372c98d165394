// Masks and coefficients of all patches: from bytes to planes.
#pragma once
#include "bisk_decoder.h"
#include "coefficients.h"
#include "container.h"
#include "mask.h"
#include "span_context.h"

namespace relief {

// What decoding by subband has come to: the last checkpoint, at the beginning of a row of a band, or of the
// coarsest LL of a patch (level kLevels). To go on from there with more bytes is to do a few rows again.
struct SubbandState {
  RangeDecoder::State coder;
  int level, type;
  uint32_t patch;
  BandStart start;
  LearnedModels models;
};

// The pyramids of all patches, one after the other (zero to begin with), and what decoding them takes.
struct Planes {
  const PatchHeader* patches;
  uint32_t patch_count;
  int level;           // coefficients of finer ones are left alone
  PlanesBegin* begin;  // of each patch's pyramid
  int32_t* q;          // only of the planes that are coded
  uint8_t* mask;
  MaskModels* mask_models;
  CoefficientModels* coefficient_models;
  SubbandState* subband_state;
  uint8_t* mask_buffer;   // of the largest patch: mask_buffer bytes
  uint8_t* mask_scratch;  // for build_masks
  // of streams that are coded by bisk, in place of those; null in others
  BiskState* bisk_state;
  BiskPatch* bisk_patches;
  BiskSet* bisk_sets;
};

// Where the planes of all patches begin, their masks, and those of all bands. Returns the number of pixels. A
// mask of which bytes are missing has none.
uint64_t decode_masks(RangeDecoder& coder, const Planes& planes, const Leaves& leaves);

// Before the first bytes of coefficients, after the masks.
void start_coefficients(const Planes& planes);

// All patches, by the stream's coder, as far as the bytes go. With more bytes, `data` from the beginning
// again, it goes on where it stopped; the result is that of all these bytes at once.
void continue_coefficients(const uint8_t* data, size_t size, bool cut, const Planes& planes,
                           const Leaves& leaves);

}  // namespace relief
