// Vertex colours of glTF are linear (3.7.2.1, COLOR_0); those of all other files, and of streams, are sRGB.
// IEC 61966-2-1.
#pragma once
#include <cstdint>

namespace relief {

uint16_t linear_of(uint8_t srgb);  // over 65535
uint8_t srgb_of(float linear);     // 0 .. 1; what is beyond is cut. srgb_of(linear_of(s) / 65535.0f) is s

}  // namespace relief
