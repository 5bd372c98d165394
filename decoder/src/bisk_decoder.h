// The decoder's side of bisk.h: from bytes to planes, as far as the bytes go, and on from there.
#pragma once
#include "bisk.h"
#include "range_decoder.h"

namespace relief {

// What decoding has come to.
struct BiskState {
  enum Phase : uint8_t { kPlanes, kMore, kPass, kDone };
  BiskModels models;
  BiskCursor cursor;
  RangeDecoder::State coder;
  Phase phase;
  uint32_t patch;   // at hand
  int layer, made;  // layers before this one, and passes of the patch in it
};

// All patches: see Planes. One state, a BiskPatch a patch and a BiskSet a pixel of the masks.
struct BiskPlanes {
  const PatchHeader* headers;
  uint32_t count;
  const PlanesBegin* begin;
  const uint8_t* mask;
  int32_t* q;
  BiskState* state;
  BiskPatch* patches;
  BiskSet* sets;
};

// After the masks.
void start_bisk(const BiskPlanes& planes);

// As far as the bytes go; with more of them it goes on where it stopped.
void continue_bisk(const uint8_t* data, size_t size, const BiskPlanes& planes);

// False if the bytes end before the pass.
template <class Coder>
bool run_bisk_pass(Coder& coder, const BiskPlanes& planes, BiskState& s, BiskPatch& patch) {
  const Pyramid p = pyramid_of(planes.headers[s.patch].width, planes.headers[s.patch].height);
  const BiskImage image = {p, planes.mask + planes.begin[s.patch].mask, planes.q + planes.begin[s.patch].q,
                           nullptr};
  BiskSet* const sets = planes.sets + patch.first_set;
  while (coder.left() >= kStepBytes) {
    const bool more = patch.refining ? refinement_step(coder, s.models, image, sets, patch, s.cursor)
                                     : significance_step(coder, s.models, image, sets, patch, s.cursor);
    if (!more) return true;
  }
  return false;
}

inline void next_bisk_patch(const BiskPlanes& planes, BiskState& s) {
  planes.patches[s.patch].before = uint8_t(s.made);
  s.made = 0;
  s.phase = BiskState::kMore;
  if (++s.patch < planes.count) return;
  s.patch = 0;
  if (++s.layer == kMostLayers) s.phase = BiskState::kDone;
}

// Codes what is next: a patch's number of planes, whether it makes another pass, or the pass. False if the
// bytes end or all is done.
template <class Coder>
bool advance_bisk(Coder& coder, const BiskPlanes& planes) {
  BiskState& s = *planes.state;
  BiskPatch& patch = planes.patches[s.patch];
  switch (s.phase) {
    case BiskState::kPlanes:
      if (coder.left() < kPlanesBytes) return false;
      patch.plane = int8_t(code_planes(coder, s.models, 0) - 1);
      if (++s.patch == planes.count) s.patch = 0, s.phase = BiskState::kMore;
      return true;
    case BiskState::kMore:
      if (patch.plane >= 0) {
        if (coder.left() < kStepBytes) return false;
        if (code_more(coder, s.models, patch, s.made, 0)) {
          s.made++;
          start_pass(patch, s.cursor);
          s.phase = BiskState::kPass;
          return true;
        }
      }
      next_bisk_patch(planes, s);
      return true;
    case BiskState::kPass:
      if (!run_bisk_pass(coder, planes, s, patch)) return false;
      end_pass(patch);
      s.phase = BiskState::kMore;
      return true;
    default:
      return false;
  }
}

}  // namespace relief
