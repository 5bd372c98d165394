// The patch table: side information of 3.5 (plane, rectangle, grid), range-coded. Shared with the encoder.
#pragma once
#include "format.h"
#include "models.h"

namespace relief {

struct PatchTableModels {
  enum Field { kWidth, kHeight, kX, kY, kZ, kSpacing, kStep, kFields };
  Model models[kFields][kGolombModels];
  PatchTableModels() {
    for (auto& field : models)
      for (Model& m : field) m = kModelInit;
  }
};

// Codes one entry; the decoder's `patch` is written, the encoder's is read. Returns false if it is out of
// range.
template <class Coder>
bool code_patch(Coder& coder, PatchTableModels& m, PatchHeader& patch) {
  constexpr int32_t kMid = (1 << (kNormalBits - 1)) - 1;
  auto raw = [&](int32_t value) {
    uint32_t r = 0;
    for (int i = kNormalBits - 1; i >= 0; i--) r = r * 2 + coder.code((value + kMid) >> i & 1, 32768);
    return int32_t(r) - kMid;
  };
  patch.u = raw(patch.u);
  patch.v = raw(patch.v);
  patch.spacing_index =
      int32_t(code_golomb(coder, m.models[PatchTableModels::kSpacing], uint32_t(patch.spacing_index)));
  patch.step_index = code_signed(coder, m.models[PatchTableModels::kStep], patch.step_index);
  patch.width = 1 + code_golomb(coder, m.models[PatchTableModels::kWidth], patch.width - 1);
  patch.height = 1 + code_golomb(coder, m.models[PatchTableModels::kHeight], patch.height - 1);
  patch.x0 = code_signed(coder, m.models[PatchTableModels::kX], patch.x0);
  patch.y0 = code_signed(coder, m.models[PatchTableModels::kY], patch.y0);
  patch.z0 = code_signed(coder, m.models[PatchTableModels::kZ], patch.z0);
  return patch.u <= kMid && patch.v <= kMid && patch.spacing_index <= kMaxSpacingIndex &&
         patch.step_index <= kMaxStepIndex && patch.step_index >= -kMaxStepIndex && patch.width <= kMaxSide &&
         patch.height <= kMaxSide;
}

}  // namespace relief
