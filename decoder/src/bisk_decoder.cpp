#include "bisk_decoder.h"

namespace relief {

RELIEF_COLD void start_bisk(const BiskPlanes& planes) {
  BiskState& s = *planes.state;
  s.models.init();
  s.coder = {};
  s.phase = BiskState::kPlanes;
  s.patch = 0;
  s.layer = s.made = 0;
  uint64_t pixels = 0;
  for (uint32_t i = 0; i < planes.count; i++) {
    BiskPatch& patch = planes.patches[i];
    patch.first_set = pixels;
    patch.plane = -1;
    const Pyramid p = pyramid_of(planes.headers[i].width, planes.headers[i].height);
    pixels += start_patch(p, planes.mask + planes.begin[i].mask, planes.sets + pixels, patch);
  }
}

void continue_bisk(const uint8_t* data, size_t size, const BiskPlanes& planes) {
  if (size < kPlanesBytes) return;  // less than a coder begins with
  BiskState& s = *planes.state;
  RangeDecoder coder(data, size, false, s.coder);
  while (advance_bisk(coder, planes)) {
  }
  s.coder = coder.state(data);
}

}  // namespace relief
