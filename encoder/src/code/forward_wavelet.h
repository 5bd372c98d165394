// Forward shape-adaptive 9/7 (3.5): the encoder's twin of decoder/src/wavelet.h.
#pragma once
#include <vector>

#include "wavelet.h"

namespace relief {

// A patch in the wavelet domain. Planes as laid out by pyramid_of.
struct WaveletImage {
  Pyramid pyramid;
  std::vector<uint8_t> mask;
  std::vector<float> value;
};

// mask, z: width * height pixels, row by row; z is read inside of the mask only.
WaveletImage forward_wavelet(uint32_t width, uint32_t height, const uint8_t* mask, const float* z);

}  // namespace relief
