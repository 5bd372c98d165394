#include "colours.h"

#include <string.h>

#include "wavelet.h"

namespace relief {

void decode_colours(const uint8_t* data, const Parsed& parsed, const Planes& heights,
                    const ColourPlanes& colours, const Leaves& leaves) {
  Planes planes = heights;
  planes.bisk_state = nullptr;
  planes.subband_state = colours.state;
  size_t at = parsed.colours_begin, left = parsed.colour_bytes;
  for (int c = 0; c < kChannels; c++) {
    planes.q = colours.q[c];
    memset(planes.q, 0, parsed.totals.coded * sizeof(*planes.q));
    const size_t wanted = parsed.header.colour_bytes[c], here = wanted < left ? wanted : left;
    start_coefficients(planes);
    continue_coefficients(data + at, here, here < wanted, planes, leaves);
    at += here, left -= here;
  }
}

void make_colour_images(const Parsed& parsed, const Planes& heights, uint32_t i, const ColourPlanes& colours,
                        float* scratch, const Leaves& leaves) {
  const Pyramid p = pyramid_of(heights.patches[i].width, heights.patches[i].height);
  const Band& low = p.low[parsed.level];
  for (int c = 0; c < kChannels; c++) {
    const float* const value =
        inverse_wavelet(p, colours.q[c] + heights.begin[i].q, heights.mask + heights.begin[i].mask,
                        colour_step(parsed.header, c), scratch, leaves, parsed.level);
    for (size_t k = 0; k < size_t(low.width) * low.height; k++) {
      const int32_t v = to_lattice(value[k]);
      colours.image[c][k] = int16_t(v < -255 ? -255 : v > 255 ? 255 : v);
    }
  }
}

void write_patch_colours(const ColourPlanes& colours, const Band& low, const uint8_t* mask, uint8_t* out,
                         size_t stride) {
  size_t i = 0;
  for (uint32_t y = 0; y < low.height; y++)
    for (uint32_t x = 0; x < low.width; x++, i++) {
      if (!mask[low.at(x, y)]) continue;
      from_luma(colours.image[0][i] + kLumaOffset, colours.image[1][i], colours.image[2][i], out);
      out[3] = 255;
      out += stride;
    }
}

void write_gap_colours(const MeshWriter& mesh, uint32_t first_vertex, uint32_t first_triangle, uint8_t* out,
                       size_t stride) {
  constexpr int kRounds = 3;  // all lie at a patch's vertex, or at one that does
  static const uint8_t kNoColour[4] = {128, 128, 128, 0};
  for (uint32_t v = first_vertex; v < mesh.vertex_count; v++) memcpy(out + v * stride, kNoColour, 4);
  for (int round = 0; round < kRounds && first_vertex < mesh.vertex_count; round++)
    for (size_t i = 3 * size_t(first_triangle); i < 3 * size_t(mesh.triangle_count); i++) {
      const uint32_t* const next = mesh.indices + (i % 3 == 2 ? i - 2 : i + 1);
      uint8_t *const to = out + mesh.indices[i] * stride, *const from = out + *next * stride;
      if (to[3] == 0) memcpy(to, from, 4);
    }
  for (uint32_t v = first_vertex; v < mesh.vertex_count; v++) out[v * stride + 3] = 255;
}

}  // namespace relief
