#include "colours/add_colours.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "allocate/allocate.h"
#include "code/stream.h"
#include "code/trellis.h"
#include "colours.h"
#include "colours/nearest_colours.h"
#include "seams/decoded.h"

namespace relief {
namespace {

// The images of all patches, channel by channel.
using ColourImages = std::array<std::vector<WaveletImage>, kChannels>;

// The mask of patch i: pixels row by row.
std::vector<uint8_t> mask_of(const OpenPatches& open, size_t i) {
  const Band b = pyramid_of(open.patches[i].width, open.patches[i].height).low[0];
  std::vector<uint8_t> mask;
  mask.reserve(size_t(b.width) * b.height);
  for (uint32_t y = 0; y < b.height; y++) {
    const uint8_t* const row = open.mask + open.begin[i].mask + b.at(0, y);
    mask.insert(mask.end(), row, row + b.width);
  }
  return mask;
}

// colours: of the pixels of all masks in order.
ColourImages images_of(const OpenPatches& open, const std::vector<Colour>& colours) {
  const size_t patches = open.parsed.header.patch_count;
  std::vector<std::vector<uint8_t>> mask(patches);
  std::vector<size_t> first(patches + 1, 0);
  for (size_t i = 0; i < patches; i++) {
    mask[i] = mask_of(open, i);
    first[i + 1] = first[i] + size_t(std::count(mask[i].begin(), mask[i].end(), 1));
  }
  ColourImages images;
  for (auto& channel : images) channel.resize(patches);
  tbb::parallel_for(size_t(0), patches, [&](size_t i) {
    std::array<std::vector<float>, kChannels> value;
    for (auto& v : value) v.resize(mask[i].size());
    size_t vertex = first[i];
    for (size_t pixel = 0; pixel < mask[i].size(); pixel++) {
      if (!mask[i][pixel]) continue;
      int channel[kChannels];
      to_luma(colours[vertex++].data(), channel);
      channel[0] -= kLumaOffset;
      for (size_t c = 0; c < kChannels; c++) value[c][pixel] = float(channel[c]);
    }
    for (size_t c = 0; c < kChannels; c++)
      images[c][i] =
          forward_wavelet(open.patches[i].width, open.patches[i].height, mask[i].data(), value[c].data());
  });
  return images;
}

// A stream without colours, and with those of any step.
class Colourer {
 public:
  Colourer(const std::vector<uint8_t>& stream, const ColourImages& images)
      : stream_(stream), images_(images) {
    if (parse_header(stream.data(), stream.size(), relief_default_limits, parsed_) != RELIEF_OK)
      throw std::logic_error("the decoder refuses the encoder's stream");
  }

  // step: of luma, 1/256 levels
  std::vector<uint8_t> with(uint32_t step) const {
    StreamHeader h = parsed_.header;
    h.colour_step = step;
    std::array<std::vector<uint8_t>, kChannels> coded;
    tbb::parallel_for(0, kChannels, [&](int c) {
      std::vector<const WaveletImage*> images;
      for (const WaveletImage& image : images_[size_t(c)]) images.push_back(&image);
      QuantisedImages quantised;
      coded[size_t(c)] = code_images(images, std::vector<float>(images.size(), colour_step(h, c)),
                                     trellis_trade(kTrade), quantised);
    });
    const auto table = stream_.begin() + ptrdiff_t(parsed_.table_begin);
    std::vector<uint8_t> out(stream_.begin(), table);
    out[4] |= kFlagColoured;
    put_varint(out, step);
    for (const auto& c : coded) put_varint(out, uint32_t(c.size()));
    out.insert(out.end(), table, stream_.end());
    for (const auto& c : coded) out.insert(out.end(), c.begin(), c.end());
    return out;
  }

 private:
  const std::vector<uint8_t>& stream_;
  const ColourImages& images_;
  Parsed parsed_;
};

double rms(const std::vector<uint8_t>& stream, const std::vector<Colour>& wanted) {
  DecodeOptions vertices_alone;  // without closing the gaps
  vertices_alone.points = true;
  const TriangleMesh mesh = decode(stream.data(), stream.size(), vertices_alone);
  double sum = 0;
  for (size_t v = 0; v < wanted.size(); v++)
    for (size_t k = 0; k < 3; k++) {
      const double d = double(mesh.colors[v][k]) - double(wanted[v][k]);
      sum += d * d;
    }
  return std::sqrt(sum / (3.0 * double(wanted.size())));
}

}  // namespace

CodedColours add_colours(const TriangleMesh& input, const ColourTarget& target,
                         std::vector<uint8_t>& stream) {
  constexpr int kMost = 10;
  constexpr double kNear = 0.008;  // of the target, in the logarithm
  PatchDecoder decoder(stream);
  std::vector<std::array<float, 3>> positions = decoder.close(Seams()).mesh.positions;
  positions.resize(decoder.parsed().header.mask_pixels);  // without what gap closing adds
  const std::vector<Colour> wanted = nearest_colours(input, positions);
  const ColourImages images = images_of(decoder.open(), wanted);
  const Colourer colourer(stream, images);
  // Bisection on the step, in its logarithm. What keeps within the target is a large step for bytes, a small
  // one for the error.
  constexpr uint32_t kFinestForBytes = 300;  // errs by about a level: finer steps would code noise
  double low = std::log(double(target.bytes ? kFinestForBytes : kLeastColourStep)),
         high = std::log(double(kMostColourStep));
  double x = std::log(256 * 1.2 * (target.bytes ? 4 : target.error));
  CodedColours result;
  std::vector<uint8_t> best;
  for (int i = 0; i < kMost; i++) {
    std::vector<uint8_t> trial = colourer.with(uint32_t(std::lround(std::exp(std::clamp(x, low, high)))));
    const double error = target.bytes ? 0 : rms(trial, wanted);
    const double y =
        target.bytes ? std::log(double(trial.size()) / double(target.bytes)) : std::log(error / target.error);
    const bool inside = y <= 0, too_fine = inside == (target.bytes == 0);
    if (best.empty() || inside || !result.met) best = std::move(trial);
    result.met = result.met || inside;
    if (inside && y > -kNear) break;
    (too_fine ? low : high) = x;
    x = (low + high) / 2;
  }
  stream = std::move(best);
  result.error = rms(stream, wanted);
  return result;
}

}  // namespace relief
