#include "gltf/srgb.h"

#include <algorithm>
#include <cmath>

namespace relief {

uint16_t linear_of(uint8_t srgb) {
  const double s = srgb / 255.0;
  const double linear = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
  return uint16_t(std::lround(65535 * linear));
}

uint8_t srgb_of(float linear) {
  const double l = linear > 0 ? std::min(double(linear), 1.0) : 0;  // NaN is 0
  const double s = l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055;
  return uint8_t(std::lround(255 * s));
}

}  // namespace relief
