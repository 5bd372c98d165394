// Colours of the vertices of patches: three images a patch, coded as elevations are. Shared with the encoder.
//
// The images are luma and two differences, by the reversible integer transform YCoCg-R (Malvar and Sullivan
// 2003), of sRGB bytes.
#pragma once
#include "mesh.h"
#include "planes.h"

namespace relief {

constexpr int kLumaOffset = 128;  // luma is coded less this. Part of the format

// Of a channel, in levels of a byte. An error in luma counts about twice as much in red, green and blue as
// one in a difference.
inline float colour_step(const StreamHeader& h, int channel) {
  return float(h.colour_step) * (channel == 0 ? 1.0f / 256 : 1.0f / 128);
}

inline int colour_byte(int v) { return v < 0 ? 0 : v > 255 ? 255 : v; }

// Luma, orange less blue, green less purple; and back, cut to bytes.
inline void to_luma(const uint8_t rgb[3], int channel[kChannels]) {
  const int orange = rgb[0] - rgb[2], t = rgb[2] + (orange >> 1), green = rgb[1] - t;
  channel[0] = t + (green >> 1), channel[1] = orange, channel[2] = green;
}
inline void from_luma(int y, int orange, int green, uint8_t rgb[3]) {
  const int t = y - (green >> 1), blue = t - (orange >> 1);
  rgb[0] = uint8_t(colour_byte(blue + orange));
  rgb[1] = uint8_t(colour_byte(green + t));
  rgb[2] = uint8_t(colour_byte(blue));
}

struct ColourPlanes {
  int32_t* q[kChannels];      // planes of coefficients, as Planes::q
  int16_t* image[kChannels];  // pixels of the largest patch
  SubbandState* state;
};

// Coefficients of all channels, as far as the bytes go. heights: of which the masks and models are used.
void decode_colours(const uint8_t* data, const Parsed& parsed, const Planes& heights,
                    const ColourPlanes& colours, const Leaves& leaves);

// The images of patch i at the level that is decoded. scratch: as for inverse_wavelet.
void make_colour_images(const Parsed& parsed, const Planes& heights, uint32_t i, const ColourPlanes& colours,
                        float* scratch, const Leaves& leaves);

// Red, green, blue and 255, `stride` bytes from one vertex to the next. Of the vertices of a patch: the
// pixels of a mask in the order of mesh_patch.
void write_patch_colours(const ColourPlanes& colours, const Band& low, const uint8_t* mask, uint8_t* out,
                         size_t stride);

// Of vertices from first_vertex on, which gap closing has added with the triangles from first_triangle on:
// the colour of a neighbour.
void write_gap_colours(const MeshWriter& mesh, uint32_t first_vertex, uint32_t first_triangle, uint8_t* out,
                       size_t stride);

}  // namespace relief
