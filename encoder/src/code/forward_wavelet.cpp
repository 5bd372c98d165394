#include "code/forward_wavelet.h"

#include <cstring>

namespace relief {
namespace {

// One lifting step of a segment [begin, end) of at least two samples, of those of one parity: sample g is
// half[g & 1][g / 2].
void lift(float* const half[2], int begin, int end, int parity, float factor, bool extend) {
  auto at = [&](int g) { return half[g & 1][g / 2]; };
  for (int g = begin + ((begin ^ parity) & 1); g < end; g += 2) {
    const bool before = g > begin, after = g + 1 < end;
    const int to = before ? -1 : 1;
    const float near = at(g + to);
    float other = before && after ? at(g + 1) : near;
    if (!(before && after) && extend && g + 3 * to >= begin && g + 3 * to < end)
      other = near + (near - at(g + 3 * to));
    half[parity][g / 2] += factor * (near + other);
  }
}

// Splits one row or column, `stride` apart in `data`, into low and high samples, segment by segment. The mask
// has the same layout. out(high, index, value) receives the coefficients.
template <class Out>
void split_line(const float* data, const uint8_t* mask, int n, ptrdiff_t stride, std::vector<float>& buffer,
                Out out) {
  buffer.resize(size_t(n) + 4);
  float* const half[2] = {buffer.data(), buffer.data() + n / 2 + 2};
  for (int i = 0; i < n;) {
    if (!mask[i * stride]) {
      i++;
      continue;
    }
    const int begin = i;
    while (i < n && mask[i * stride]) i++;
    const int end = i;
    if (end - begin == 1) {
      out(false, begin / 2, data[begin * stride] * kSqrt2);
      continue;
    }
    for (int g = begin; g < end; g++) half[g & 1][g / 2] = data[g * stride];
    lift(half, begin, end, 1, kLift[0], true);
    lift(half, begin, end, 0, kLift[1], true);
    lift(half, begin, end, 1, kLift[2], true);
    lift(half, begin, end, 0, kLift[3], false);
    for (int g = begin; g < end; g++)
      out(g & 1, g / 2, half[g & 1][g / 2] * (g & 1 ? kHighScale : kLowScale));
  }
}

}  // namespace

WaveletImage forward_wavelet(uint32_t width, uint32_t height, const uint8_t* mask, const float* z) {
  WaveletImage image;
  image.pyramid = pyramid_of(width, height);
  const Pyramid& p = image.pyramid;
  image.mask.assign(p.size, 0);
  image.value.assign(p.size, 0);
  for (uint32_t y = 0; y < height; y++)
    for (uint32_t x = 0; x < width; x++) {
      const size_t i = size_t(y) * width + x;
      image.mask[p.low[0].at(x, y)] = mask[i];
      if (mask[i]) image.value[p.low[0].at(x, y)] = z[i];
    }
  std::vector<uint8_t> scratch(2 * size_t(width) * height + 8 * size_t(width) + 64);
  build_masks(p, image.mask.data(), scratch.data());
  std::vector<float> buffer, lo, hi;
  std::vector<uint8_t> lo_mask, hi_mask;
  for (int l = 0; l < kLevels; l++) {
    const Band& in = p.low[l];
    const int w = int(in.width), h = int(in.height), lw = (w + 1) / 2, hw = w / 2;
    lo.assign(size_t(lw) * h, 0), hi.assign(size_t(hw) * h, 0);
    lo_mask.assign(lo.size(), 0), hi_mask.assign(hi.size(), 0);
    for (int y = 0; y < h; y++) {
      const size_t row = in.at(0, uint32_t(y));
      split_line(&image.value[row], &image.mask[row], w, 1, buffer, [&](bool high, int k, float v) {
        const size_t i = size_t(y) * (high ? hw : lw) + k;
        (high ? hi : lo)[i] = v;
        (high ? hi_mask : lo_mask)[i] = 1;
      });
    }
    auto columns = [&](const std::vector<float>& s, const std::vector<uint8_t>& m, int n, const Band& even,
                       const Band& odd) {
      for (int x = 0; x < n; x++)
        split_line(&s[size_t(x)], &m[size_t(x)], h, n, buffer, [&](bool high, int k, float v) {
          image.value[(high ? odd : even).at(uint32_t(x), uint32_t(k))] = v;
        });
    };
    columns(lo, lo_mask, lw, p.low[l + 1], p.high[l][1]);
    if (hw) columns(hi, hi_mask, hw, p.high[l][0], p.high[l][2]);
  }
  return image;
}

}  // namespace relief
