#include "code/stream.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "code/bisk_encoder.h"
#include "code/quantise.h"
#include "code/range_encoder.h"
#include "code/trellis.h"
#include "container.h"
#include "mask.h"
#include "patch_table.h"
#include "span_context.h"
#include "surface/largest_first.h"

namespace relief {
namespace {

constexpr float kLeastStep = 1.0f / 64;  // of a stream

void put_float(std::vector<uint8_t>& out, float f) {
  uint32_t bits;
  std::memcpy(&bits, &f, 4);
  for (int i = 0; i < 4; i++) out.push_back(uint8_t(bits >> (8 * i)));
}

void code_masks(RangeEncoder& coder, const std::vector<CodedPatch>& patches, StreamParts& parts) {
  const auto models = std::make_unique<MaskModels>();
  models->init();
  std::vector<uint8_t> buffer;
  for (const CodedPatch& p : patches) {
    const uint32_t w = p.header.width, h = p.header.height;
    const size_t stride = mask_stride(w);
    buffer.assign(mask_buffer(w, h), 0);
    uint8_t* const rows = buffer.data() + kMaskAbove * stride + kMaskBefore;
    for (uint32_t y = 0; y < h; y++) {
      std::memcpy(rows + y * stride, p.mask + size_t(y) * w, w);
      for (uint32_t x = 0; x < w; x++) parts.mask_pixels += p.mask[size_t(y) * w + x];
    }
    code_mask(coder, *models, rows, w, h, stride);
    parts.boundary_nodes += count_boundary_nodes(p.mask, w, h);
  }
}

std::vector<const WaveletImage*> images_of(const std::vector<CodedPatch>& patches) {
  std::vector<const WaveletImage*> images;
  for (const CodedPatch& p : patches) images.push_back(p.image);
  return images;
}

std::vector<float> steps_of(const std::vector<CodedPatch>& patches, const StreamPlacement& placement) {
  std::vector<float> steps;
  for (const CodedPatch& p : patches) steps.push_back(step_of(placement, p.header));
  return steps;
}

}  // namespace

void put_varint(std::vector<uint8_t>& out, uint32_t value) {
  for (; value >= 128; value >>= 7) out.push_back(uint8_t(value | 128));
  out.push_back(uint8_t(value));
}

namespace {

struct QuantisedImage {
  const WaveletImage* image;
  float step;
  std::vector<int32_t>* q;
};

// learned: what bits cost at first.
void quantise_image(const QuantisedImage& i, float trade, const CoefficientModels& learned) {
  const auto models = std::make_unique<CoefficientModels>(learned);
  i.q->assign(i.image->pyramid.size, 0);
  quantise_low(*i.image, i.step, i.q->data());
  for (int level = kLevels - 1; level >= 0; level--)
    for (int type = 0; type < 3; type++)
      quantise_by_trellis(*models, *i.image, level, type, i.step, trade, i.q->data());
}

// Returns the models as they are in the end.
template <class Coder>
std::unique_ptr<CoefficientModels> code_quantised(Coder& coder, const std::vector<QuantisedImage>& images) {
  auto models = std::make_unique<CoefficientModels>();
  models->init();
  for (const QuantisedImage& i : images)
    code_low(coder, *models, i.image->pyramid, i.q->data(), i.image->mask.data());
  for (int level = kLevels - 1; level >= 0; level--)
    for (const QuantisedImage& i : images)
      for (int type = 0; type < 3; type++)
        code_band(coder, *models, i.image->pyramid, i.q->data(), i.image->mask.data(), level, type);
  return models;
}

std::vector<QuantisedImage> entries_of(const std::vector<const WaveletImage*>& images,
                                       const std::vector<float>& step, QuantisedImages& known) {
  std::vector<QuantisedImage> all;
  for (size_t i = 0; i < images.size(); i++)
    all.push_back({images[i], step[i], &known.of(images[i], step[i])});
  return all;
}

// Quantises those that are not known yet. Returns all.
std::vector<QuantisedImage> quantise_images(const std::vector<const WaveletImage*>& images,
                                            const std::vector<float>& step, float trade,
                                            QuantisedImages& known) {
  const std::vector<QuantisedImage> all = entries_of(images, step, known);
  std::vector<QuantisedImage> fresh;
  for (const QuantisedImage& i : all)
    if (i.q->empty()) fresh.push_back(i);
  auto quantise = [&] {
    largest_first(
        fresh.size(), [&](size_t i) { return fresh[i].image->pyramid.size; },
        [&](size_t i) { quantise_image(fresh[i], trade, *known.learned); });
  };
  if (!known.learned) {
    known.learned = std::make_unique<CoefficientModels>();
    known.learned->init();
    quantise();
    CountingCoder counter;
    known.learned = code_quantised(counter, all);
  }
  quantise();
  return all;
}

}  // namespace

std::vector<uint8_t> code_images(const std::vector<const WaveletImage*>& images,
                                 const std::vector<float>& step, float trade, QuantisedImages& known) {
  const std::vector<QuantisedImage> all = quantise_images(images, step, trade, known);
  RangeEncoder coder;
  known.learned = code_quantised(coder, all);
  return coder.finish();
}

float step_of(const StreamPlacement& placement, const PatchHeader& patch) {
  return float(double(placement.step) * quarter_power(patch.step_index));
}

void quantise(const std::vector<CodedPatch>& patches, const StreamPlacement& placement,
              QuantisedImages& known) {
  quantise_images(images_of(patches), steps_of(patches, placement), placement.trade, known);
}

void learn(const std::vector<CodedPatch>& patches, const StreamPlacement& placement, QuantisedImages& known) {
  CountingCoder counter;
  known.learned =
      code_quantised(counter, entries_of(images_of(patches), steps_of(patches, placement), known));
}

uint32_t count_boundary_nodes(const uint8_t* mask, uint32_t width, uint32_t height) {
  const int w = int(width), h = int(height);
  auto covered = [&](int x, int y) {
    if (x < 0 || y < 0 || x + 1 >= w || y + 1 >= h) return false;
    const uint8_t* m = mask + size_t(y) * width + size_t(x);
    return m[0] + m[1] + m[w] + m[w + 1] >= 3;
  };
  auto full = [&](int x, int y) {
    if (!covered(x, y)) return false;
    const uint8_t* m = mask + size_t(y) * width + size_t(x);
    return m[0] + m[1] + m[w] + m[w + 1] == 4;
  };
  uint32_t n = 0;
  for (int y = 0; y < h; y++)
    for (int x = 0; x < w; x++) {
      if (!mask[size_t(y) * width + size_t(x)]) continue;
      // inner: the four cells around close a fan; a cell of three whose missing pixel is the opposite one
      // closes it too, since its triangle has both sides at this pixel
      auto closes = [&](int cx, int cy, int mx, int my) {
        return full(cx, cy) || (covered(cx, cy) && !mask[size_t(my) * width + size_t(mx)]);
      };
      const bool inner = closes(x, y, x + 1, y + 1) && closes(x - 1, y, x - 1, y + 1) &&
                         closes(x - 1, y - 1, x - 1, y - 1) && closes(x, y - 1, x + 1, y - 1);
      n += !inner;
    }
  return n;
}

StreamParts code_stream(const std::vector<CodedPatch>& patches, const StreamPlacement& placement,
                        QuantisedImages& known) {
  StreamParts parts;
  parts.placement = placement;
  parts.patches = uint32_t(patches.size());
  auto code_table = [&] {
    RangeEncoder coder;
    PatchTableModels table;
    for (const CodedPatch& p : patches) {
      PatchHeader header = p.header;
      code_patch(coder, table, header);
    }
    parts.table_bits = 8.0 * double(coder.size());
    code_masks(coder, patches, parts);
    parts.table = coder.finish();
  };
  if (placement.bisk) {
    code_table();
    parts.placement.step = std::max(kLeastStep, finest_bisk_step(placement.step));
    EmbeddedCode code = code_bisk(patches, parts.placement);
    parts.most_coefficient_bytes = code.bytes.size();
    const size_t wanted = placement.coefficient_bytes ? placement.coefficient_bytes : code.at_trade;
    code.bytes.resize(std::min(wanted, code.bytes.size()));
    parts.coefficients = std::move(code.bytes);
  } else {
    tbb::parallel_invoke(code_table, [&] {
      parts.coefficients =
          code_images(images_of(patches), steps_of(patches, placement), placement.trade, known);
    });
    parts.most_coefficient_bytes = parts.coefficients.size();
  }
  return parts;
}

std::vector<uint8_t> code_seams(const Seams& seams) {
  std::vector<uint8_t> out;
  size_t needed = 0;  // bytes up to the last list that is not empty
  uint32_t last = 0;
  auto number = [&](uint32_t n) { put_varint(out, n + 1 - last), last = n + 1; };
  auto end_list = [&](bool empty) {
    if (!empty) needed = out.size();
    put_varint(out, 0);
    last = 0;
  };
  for (uint32_t n : seams.dropped_links) number(n);
  end_list(seams.dropped_links.empty());
  for (uint32_t n : seams.handles) number(n);
  end_list(seams.handles.empty());
  for (const auto& [a, b] : seams.added_links) number(a), put_varint(out, b - a);
  end_list(seams.added_links.empty());
  for (uint32_t n : seams.holes) number(n);
  end_list(seams.holes.empty());
  for (const auto& [a, b] : seams.tubes) number(a), put_varint(out, b - a);
  end_list(seams.tubes.empty());
  for (const SteinerPoint& s : seams.steiner_points) {
    number(s.triangle);
    put_varint(out, s.edge + 3 * (uint32_t(s.height) << 1 ^ uint32_t(s.height >> 31)));
  }
  end_list(seams.steiner_points.empty());
  out.resize(needed);
  return out;
}

std::vector<uint8_t> assemble(const StreamParts& parts, const StreamCounts& counts, const Seams& seams) {
  const StreamPlacement& s = parts.placement;
  const std::vector<uint8_t> seam_bytes = code_seams(seams);
  std::vector<uint8_t> out = {'R', 'L', 'F', RELIEF_STREAM_VERSION,
                              uint8_t((s.closed ? kFlagClosed : 0) | (s.bisk ? kFlagBisk : 0))};
  for (float o : s.origin) put_float(out, o);
  put_float(out, s.scale);
  put_float(out, s.spacing);
  put_float(out, s.step);
  for (uint32_t c :
       {parts.patches, parts.mask_pixels, counts.boundary_nodes, counts.vertices, counts.triangles,
        uint32_t(parts.table.size()), uint32_t(parts.coefficients.size()), uint32_t(seam_bytes.size())})
    put_varint(out, c);
  for (const std::vector<uint8_t>* part : {&parts.table, &parts.coefficients, &seam_bytes})
    out.insert(out.end(), part->begin(), part->end());
  return out;
}

}  // namespace relief
