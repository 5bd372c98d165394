// The coding parts: what the encoder writes the decoder reads, and how well.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numeric>
#include <random>

#include "bisk_decoder.h"
#include "code/bisk_encoder.h"
#include "code/forward_wavelet.h"
#include "code/ledger.h"
#include "code/quantise.h"
#include "code/range_encoder.h"
#include "code/stream.h"
#include "code/trellis.h"
#include "container.h"
#include "decoded.h"
#include "golden.h"
#include "mask.h"
#include "patch_table.h"
#include "resample/clean_mask.h"
#include "resample/elevation_map.h"
#include "resample/extend_border.h"
#include "restore.h"
#include "seams/decoded.h"
#include "span_context.h"

namespace relief {
namespace {

using Random = std::mt19937;

double uniform(Random& random) { return double(random()) / 4294967296.0; }

// --- the range coder ---

struct Decision {
  int bit;
  uint32_t p16;
};

std::vector<uint8_t> encode_decisions(const std::vector<Decision>& decisions) {
  RangeEncoder coder;
  for (const Decision& d : decisions) coder.code(d.bit, d.p16);
  return coder.finish();
}

void expect_decoded(const std::vector<uint8_t>& bytes, const std::vector<Decision>& decisions) {
  const HeapBlock exact(bytes.data(), bytes.size());
  RangeDecoder decoder(exact.data(), exact.size(), false);
  for (size_t i = 0; i < decisions.size(); i++)
    ASSERT_EQ(decoder.code(0, decisions[i].p16), decisions[i].bit)
        << "decision " << i << " of " << decisions.size();
  EXPECT_FALSE(decoder.exhausted());
}

double bits_of(const std::vector<Decision>& decisions) {
  double bits = 0;
  for (const Decision& d : decisions) bits -= std::log2((d.bit ? d.p16 : 65536 - d.p16) / 65536.0);
  return bits;
}

TEST(RangeCoder, RandomDecisions) {
  Random random(1);
  for (int round = 0; round < 300; round++) {
    std::vector<Decision> decisions(random() % 3000);
    for (Decision& d : decisions) {
      d.p16 = 32 + random() % (65504 - 32 + 1);
      if (random() % 4 == 0) d.p16 = random() % 2 ? 32 : 65504;  // the ends that model_p16 allows
      d.bit = round % 3 == 0 ? int(random() & 1) : uniform(random) * 65536 < d.p16;
    }
    const std::vector<uint8_t> bytes = encode_decisions(decisions);
    expect_decoded(bytes, decisions);
    EXPECT_LE(double(bytes.size()), bits_of(decisions) / 8 * 1.001 + 2) << "decisions " << decisions.size();
  }
}

// The least likely decision every time, and the most likely ones, which let the low end creep up to a long
// carry.
TEST(RangeCoder, ExtremeDecisions) {
  for (uint32_t p16 : {1u, 32u, 32768u, 65504u, 65535u})
    for (int bit : {0, 1}) {
      const std::vector<Decision> same(5000, Decision{bit, p16});
      expect_decoded(encode_decisions(same), same);
    }
}

// A number whose bytes stay 0xff (0x00) for long is come back to by the decisions that a decoder reads from
// it: the encoder must hold 100 bytes back until it knows whether a carry runs through them.
TEST(RangeCoder, CarriesThroughManyBytes) {
  for (uint8_t fill : {0xff, 0x00})
    for (uint32_t seed = 0; seed < 20; seed++) {
      std::vector<uint8_t> number(200, fill);
      number[0] = fill ? 0x7f : 0x80;
      number[100] = 0x55;  // else the shorter 0x80 may do for 0x7fff..
      RangeDecoder steer(number.data(), number.size(), false);
      Random random(seed);
      std::vector<Decision> decisions;
      for (int i = 0; i < 1200; i++) {
        const uint32_t p16 = uint32_t(1000 + random() % 60000);
        decisions.push_back({steer.code(0, p16), p16});
      }
      const std::vector<uint8_t> bytes = encode_decisions(decisions);
      expect_decoded(bytes, decisions);
      ASSERT_GT(bytes.size(), 100u);
      for (size_t i = 0; i < 100; i++) ASSERT_EQ(bytes[i], number[i]) << i;
    }
}

// The end of the bytes is the shortest number in the last interval, even if a carry then runs through all of
// them.
TEST(RangeCoder, EndsWithTheShortestNumber) {
  std::vector<Decision> decisions = {{1, 32768}};  // the lower half, then always its upper end
  for (int i = 0; i < 1000; i++) decisions.push_back({0, 32768});
  const std::vector<uint8_t> bytes = encode_decisions(decisions);
  expect_decoded(bytes, decisions);
  EXPECT_LE(double(bytes.size()), bits_of(decisions) / 8 + 1);
}

TEST(RangeCoder, DropsTrailingZeros) {
  Random random(4);
  for (int round = 0; round < 2000; round++) {
    std::vector<Decision> decisions(1 + random() % 40);
    for (Decision& d : decisions) d = {int(random() & 1), uint32_t(32 + random() % 65000)};
    const std::vector<uint8_t> bytes = encode_decisions(decisions);
    if (!bytes.empty()) {
      EXPECT_NE(bytes.back(), 0);
    }
    expect_decoded(bytes, decisions);
  }
  EXPECT_TRUE(encode_decisions({}).empty());
}

TEST(RangeCoder, TellsWhenACutStreamEnds) {
  Random random(5);
  std::vector<Decision> decisions(4000);
  for (Decision& d : decisions) d = {int(random() & 1), 32768};
  const std::vector<uint8_t> bytes = encode_decisions(decisions);
  for (size_t n : {size_t(0), size_t(1), size_t(100), bytes.size() - 5}) {
    RangeDecoder decoder(bytes.data(), n, true);
    size_t good = 0;
    while (!decoder.exhausted()) {
      if (decoder.code(0, 32768) != decisions[good].bit) break;
      good++;
    }
    // every bit up to there is right, and there are about 8 a byte of them
    EXPECT_TRUE(decoder.exhausted());
    EXPECT_GE(good + 40, 8 * n);
    EXPECT_LE(good, 8 * n + 8);
  }
}

TEST(RangeCoder, CountingCoderCountsWhatTheEncoderWrites) {
  Random random(6);
  RangeEncoder encoder;
  CountingCoder counting;
  for (int i = 0; i < 200000; i++) {
    const uint32_t p16 = 32 + random() % 65473;
    const int bit = uniform(random) * 65536 < p16;
    encoder.code(bit, p16);
    counting.code(bit, p16);
  }
  const double bits = 8.0 * double(encoder.finish().size());
  EXPECT_NEAR(counting.bits(), bits, 0.002 * bits);
}

// --- numbers ---

TEST(Golomb, RoundTrip) {
  Random random(7);
  std::vector<uint32_t> values;
  for (uint32_t k = 0; k < 20; k++)
    for (uint32_t v : {(1u << k) - 2, (1u << k) - 1, 1u << k, (1u << k) + 1}) values.push_back(v);
  values.push_back((1u << 20) - 1);
  values.push_back((1u << 20));
  for (int i = 0; i < 5000; i++) values.push_back(random() >> (12 + random() % 20));
  std::erase_if(values, [](uint32_t v) { return v > (1u << 21) - 2; });
  std::vector<Model> models(kGolombModels, kModelInit);
  RangeEncoder encoder;
  for (uint32_t v : values) EXPECT_EQ(code_golomb(encoder, models.data(), v), v);
  const std::vector<uint8_t> bytes = encoder.finish();
  models.assign(kGolombModels, kModelInit);
  RangeDecoder decoder(bytes.data(), bytes.size(), false);
  for (uint32_t v : values) ASSERT_EQ(code_golomb(decoder, models.data(), 0), v);
}

TEST(Golomb, SignedRoundTrip) {
  std::vector<int32_t> values = {0, 1, -1, 2, -2, 1000, -1000, 500000, -500000};
  for (int32_t i = -2000; i < 2000; i++) values.push_back(i * 7);
  std::vector<Model> models(kGolombModels, kModelInit);
  RangeEncoder encoder;
  for (int32_t v : values) EXPECT_EQ(code_signed(encoder, models.data(), v), v);
  const std::vector<uint8_t> bytes = encoder.finish();
  models.assign(kGolombModels, kModelInit);
  RangeDecoder decoder(bytes.data(), bytes.size(), false);
  for (int32_t v : values) ASSERT_EQ(code_signed(decoder, models.data(), 0), v);
}

TEST(Models, LearnTheFrequency) {
  Random random(8);
  for (double p : {0.02, 0.3, 0.5, 0.9}) {
    Model m = kModelInit;
    double mean = 0;
    for (int i = 0; i < 20000; i++) {
      model_update<kCoefficientLimit>(m, uniform(random) < p);
      if (i >= 10000) mean += model_p16(m) / 65536.0 / 10000;
    }
    EXPECT_NEAR(mean, p, 0.01);
  }
  Model m = kModelInit;
  for (int bit : {0, 1})
    for (int i = 0; i < 100000; i++) {
      model_update<kMaskLimit>(m, bit);
      ASSERT_GE(model_p16(m), 32u);
      ASSERT_LE(model_p16(m), 65504u);
    }
}

// --- the patch table ---

PatchHeader random_patch(Random& random) {
  const int32_t mid = (1 << (kNormalBits - 1)) - 1;
  auto between = [&](int32_t lo, int32_t hi) { return lo + int32_t(random() % uint32_t(hi - lo + 1)); };
  PatchHeader p;
  p.width = uint32_t(between(1, random() % 2 ? 40 : int32_t(kMaxSide)));
  p.height = uint32_t(between(1, random() % 2 ? 40 : int32_t(kMaxSide)));
  p.x0 = between(-50000, 50000), p.y0 = between(-300, 300), p.z0 = between(-500000, 500000);
  p.u = between(-mid, mid), p.v = between(-mid, mid);
  p.spacing_index = between(0, kMaxSpacingIndex);
  p.step_index = between(-kMaxStepIndex, kMaxStepIndex);
  return p;
}

TEST(PatchTable, RoundTrip) {
  Random random(9);
  std::vector<PatchHeader> patches(500);
  for (PatchHeader& p : patches) p = random_patch(random);
  RangeEncoder encoder;
  PatchTableModels models;
  for (PatchHeader p : patches) EXPECT_TRUE(code_patch(encoder, models, p));
  const std::vector<uint8_t> bytes = encoder.finish();
  RangeDecoder decoder(bytes.data(), bytes.size(), false);
  PatchTableModels again;
  for (const PatchHeader& p : patches) {
    PatchHeader q = {};
    ASSERT_TRUE(code_patch(decoder, again, q));
    EXPECT_EQ(q.width, p.width);
    EXPECT_EQ(q.height, p.height);
    EXPECT_EQ(q.x0, p.x0);
    EXPECT_EQ(q.y0, p.y0);
    EXPECT_EQ(q.z0, p.z0);
    EXPECT_EQ(q.u, p.u);
    EXPECT_EQ(q.v, p.v);
    EXPECT_EQ(q.spacing_index, p.spacing_index);
    EXPECT_EQ(q.step_index, p.step_index);
  }
}

TEST(PatchTable, RefusesWhatIsOutOfRange) {
  auto accepted = [](auto change) {
    PatchHeader p = {};
    p.width = p.height = 8;
    change(p);
    RangeEncoder encoder;
    PatchTableModels models;
    code_patch(encoder, models, p);
    const std::vector<uint8_t> bytes = encoder.finish();
    RangeDecoder decoder(bytes.data(), bytes.size(), false);
    PatchTableModels again;
    PatchHeader q = {};
    return code_patch(decoder, again, q);
  };
  EXPECT_TRUE(accepted([](PatchHeader&) {}));
  EXPECT_TRUE(accepted([](PatchHeader& p) { p.width = kMaxSide; }));
  EXPECT_FALSE(accepted([](PatchHeader& p) { p.width = kMaxSide + 1; }));
  EXPECT_FALSE(accepted([](PatchHeader& p) { p.height = kMaxSide + 1; }));
  EXPECT_FALSE(accepted([](PatchHeader& p) { p.spacing_index = kMaxSpacingIndex + 1; }));
  EXPECT_FALSE(accepted([](PatchHeader& p) { p.step_index = kMaxStepIndex + 1; }));
  EXPECT_FALSE(accepted([](PatchHeader& p) { p.step_index = -kMaxStepIndex - 1; }));
  EXPECT_FALSE(accepted([](PatchHeader& p) { p.u = 1 << (kNormalBits - 1); }));
}

TEST(Frame, IsOrthonormalForEveryNormal) {
  const int32_t mid = (1 << (kNormalBits - 1)) - 1;
  double widest = 0;
  for (int32_t u = -mid; u <= mid; u++)
    for (int32_t v = -mid; v <= mid; v++) {
      const Frame f = frame_of(u, v);
      auto dot = [](const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
      widest = std::max({widest, std::fabs(dot(f.n, f.n) - 1), std::fabs(dot(f.e1, f.e1) - 1),
                         std::fabs(dot(f.e2, f.e2) - 1), std::fabs(dot(f.n, f.e1)), std::fabs(dot(f.n, f.e2)),
                         std::fabs(dot(f.e1, f.e2))});
    }
  EXPECT_LT(widest, 1e-12);
}

// --- masks ---

// A blob: a few discs joined and cut.
std::vector<uint8_t> random_mask(Random& random, uint32_t w, uint32_t h) {
  std::vector<uint8_t> mask(size_t(w) * h, 0);
  for (int i = 0; i < 8; i++) {
    const double cx = uniform(random) * w, cy = uniform(random) * h,
                 r = uniform(random) * 0.4 * std::max(w, h) + 0.7;
    for (uint32_t y = 0; y < h; y++)
      for (uint32_t x = 0; x < w; x++)
        if (std::hypot(x - cx, y - cy) < r * (i < 5 ? 1 : 0.5)) mask[size_t(y) * w + x] = i < 5;
  }
  return mask;
}

struct Picture {
  uint32_t w, h;
  std::vector<uint8_t> mask;
};

std::vector<Picture> random_pictures(Random& random) {
  std::vector<Picture> pictures;
  for (int i = 0; i < 40; i++) {
    const uint32_t w = 1 + random() % 70, h = 1 + random() % 70;
    pictures.push_back({w, h, random_mask(random, w, h)});
  }
  for (auto [w, h] : {std::pair{1u, 1u}, {1u, 50u}, {50u, 1u}, {2u, 2u}, {3u, 40u}})
    for (int kind = 0; kind < 3; kind++) {  // full, noise, empty
      Picture p = {w, h, std::vector<uint8_t>(size_t(w) * h, kind == 0)};
      if (kind == 1)
        for (uint8_t& m : p.mask) m = random() & 1;
      pictures.push_back(p);
    }
  return pictures;
}

// Puts a picture where the templates of code_mask may look around it.
std::vector<uint8_t> with_margin(const Picture& p) {
  std::vector<uint8_t> buffer(mask_buffer(p.w, p.h), 0);
  for (uint32_t y = 0; y < p.h; y++)
    std::copy_n(p.mask.begin() + ptrdiff_t(size_t(y) * p.w), p.w,
                buffer.begin() + ptrdiff_t((y + kMaskAbove) * mask_stride(p.w) + kMaskBefore));
  return buffer;
}

uint8_t* rows_of(std::vector<uint8_t>& buffer, const Picture& p) {
  return buffer.data() + kMaskAbove * mask_stride(p.w) + kMaskBefore;
}

TEST(Mask, RoundTrip) {
  Random random(10);
  const std::vector<Picture> pictures = random_pictures(random);
  auto models = std::make_unique<MaskModels>();
  models->init();
  RangeEncoder encoder;
  for (const Picture& p : pictures) {
    std::vector<uint8_t> buffer = with_margin(p);
    code_mask(encoder, *models, rows_of(buffer, p), p.w, p.h, mask_stride(p.w));
    EXPECT_EQ(buffer, with_margin(p)) << "the encoder changed the mask";
  }
  const std::vector<uint8_t> bytes = encoder.finish();
  RangeDecoder decoder(bytes.data(), bytes.size(), false);
  models->init();
  for (const Picture& p : pictures) {
    std::vector<uint8_t> buffer(mask_buffer(p.w, p.h), 0);
    code_mask(decoder, *models, rows_of(buffer, p), p.w, p.h, mask_stride(p.w));
    ASSERT_EQ(buffer, with_margin(p)) << p.w << " x " << p.h;
  }
}

// A smooth outline costs few bits a pixel of its length.
TEST(Mask, SmoothOutlinesAreCheap) {
  auto models = std::make_unique<MaskModels>();
  models->init();
  CountingCoder counting;
  double outline = 0;
  for (int i = 0; i < 20; i++) {
    const double r = 20 + i, a = 1 + 0.05 * i;
    Picture p = {100, 100, std::vector<uint8_t>(10000, 0)};
    for (uint32_t y = 0; y < 100; y++)
      for (uint32_t x = 0; x < 100; x++) p.mask[y * 100 + x] = std::hypot((x - 50.0) / a, (y - 50.0) * a) < r;
    std::vector<uint8_t> buffer = with_margin(p);
    code_mask(counting, *models, rows_of(buffer, p), p.w, p.h, mask_stride(p.w));
    outline += 2 * 3.14159 * r;
  }
  EXPECT_LT(counting.bits() / outline, 1.5);
}

TEST(Mask, LogisticTablesAreInverse) {
  Logistic logistic;
  logistic.init();
  for (int p = 1; p < 4095; p++) {
    ASSERT_LE(logistic.stretch[p - 1], logistic.stretch[p]);
    const int back = Logistic::squash(logistic.stretch[p]);
    EXPECT_LE(std::abs(back - p), 1 + p * (4096 - p) / 4096 / 50) << p;
  }
}

// --- the wavelet ---

std::vector<float> random_heights(Random& random, const Picture& p, double amplitude) {
  std::vector<float> z(p.mask.size());
  const double a = uniform(random), b = uniform(random), c = uniform(random);
  for (uint32_t y = 0; y < p.h; y++)
    for (uint32_t x = 0; x < p.w; x++)
      z[size_t(y) * p.w + x] = float(
          amplitude * (std::sin(0.3 * a * x + b) + std::cos(0.2 * y + c * x * 0.1) + 0.5 * uniform(random)));
  return z;
}

// Coefficients rounded to the bands' steps.
std::vector<int32_t> rounded(const WaveletImage& image, float step) {
  std::vector<int32_t> q(image.pyramid.size, 0);
  auto fill = [&](const Band& b, float s) {
    for (uint32_t y = 0; y < b.height; y++)
      for (uint32_t x = 0; x < b.width; x++) {
        const size_t i = b.at(x, y);
        q[i] = image.mask[i] ? int32_t(std::lround(image.value[i] / s)) : 0;
      }
  };
  fill(image.pyramid.low[kLevels], step);
  for (int l = 0; l < kLevels; l++)
    for (int t = 0; t < 3; t++) fill(image.pyramid.high[l][t], step * band_step(l, t));
  return q;
}

// Whole numbers come back to within rounding: quantise with a step so fine that the planes' integers hold
// everything.
TEST(Wavelet, InverseOfForwardOnAnyMask) {
  Random random(11);
  for (const Picture& p : random_pictures(random)) {
    const double amplitude = 1000;
    const std::vector<float> z = random_heights(random, p, amplitude);
    const WaveletImage image = forward_wavelet(p.w, p.h, p.mask.data(), z.data());
    const float step = 0.01f;
    const std::vector<int32_t> q = rounded(image, step);
    std::vector<float> scratch(wavelet_scratch(p.w, p.h));
    const float* back = inverse_wavelet(image.pyramid, q.data(), image.mask.data(), step, scratch.data());
    for (size_t i = 0; i < z.size(); i++)
      if (p.mask[i]) {
        ASSERT_NEAR(back[i], z[i], 1e-3 * amplitude)
            << p.w << " x " << p.h << " at " << i % p.w << ", " << i / p.w;
      }
  }
}

// What is smooth comes nearer to what it was before quantisation, inside and along the mask's edge alike, and
// nothing moves farther than the limits.
TEST(Restoration, TakesNoiseOfQuantisationAway) {
  Random random(13);
  constexpr float kStep = 1;
  double before[2] = {0, 0}, after[2] = {0, 0};  // squared error inside, at the edge
  for (const Picture& p : random_pictures(random)) {
    std::vector<float> z(p.mask.size());
    for (uint32_t i = 0; i < z.size(); i++)
      z[i] = float(20 * std::sin(0.2 * (i % p.w)) * std::cos(0.15 * (i / p.w)));
    const WaveletImage image = forward_wavelet(p.w, p.h, p.mask.data(), z.data());
    const std::vector<int32_t> q = rounded(image, kStep);
    std::vector<float> scratch(wavelet_scratch(p.w, p.h)), restored(z.size() + kBlock);
    const float* noisy = inverse_wavelet(image.pyramid, q.data(), image.mask.data(), kStep, scratch.data());
    restore(image.pyramid, image.mask.data(), noisy, kStep, restored.data());
    const Band& b = image.pyramid.low[0];
    for (uint32_t i = 0; i < z.size(); i++) {
      if (!p.mask[i]) continue;
      const uint8_t* const m = &image.mask[b.at(i % p.w, i / p.w)];
      const bool edge = !(m[-1] & m[1] & m[-ptrdiff_t(b.stride)] & m[b.stride]);
      before[edge] += std::pow(noisy[i] - z[i], 2);
      after[edge] += std::pow(restored[i] - z[i], 2);
      ASSERT_LE(std::fabs(restored[i] - noisy[i]), 4 * kRestoreLimit * kStep + 1e-5);
    }
  }
  std::printf("squared error inside: %.2f of what it was, at the edge: %.2f\n", after[0] / before[0],
              after[1] / before[1]);
  EXPECT_LT(after[0], 0.9 * before[0]);
  EXPECT_LT(after[1], 0.95 * before[1]);
}

TEST(Restoration, LeavesCubicsAlone) {
  const uint32_t w = 21, h = 17;
  const Pyramid y = pyramid_of(w, h);
  std::vector<uint8_t> mask(y.size, 0);
  const size_t slack = kMargin + kBlock;
  std::vector<float> z(w * h + 2 * slack), restored(w * h + slack);
  for (uint32_t v = 0; v < h; v++)
    for (uint32_t u = 0; u < w; u++) {
      mask[y.low[0].at(u, v)] = 1;
      z[slack + v * w + u] = float(u * u * u) - 3 * float(u * u) + float(v * v * v) + 2 * float(u * v);
    }
  restore(y, mask.data(), z.data() + slack, 1000, restored.data());
  for (uint32_t v = 2; v + 2 < h; v++)
    for (uint32_t u = 2; u + 2 < w; u++) ASSERT_EQ(restored[v * w + u], z[slack + v * w + u]);
}

// Every pixel has one coefficient (the transform is critically sampled).
TEST(Wavelet, AsManyCoefficientsAsPixels) {
  Random random(12);
  for (const Picture& p : random_pictures(random)) {
    const std::vector<float> z(p.mask.size(), 1.0f);
    const WaveletImage image = forward_wavelet(p.w, p.h, p.mask.data(), z.data());
    const Pyramid& y = image.pyramid;
    auto count = [&](const Band& b) {
      size_t n = 0;
      for (uint32_t v = 0; v < b.height; v++)
        for (uint32_t u = 0; u < b.width; u++) n += image.mask[b.at(u, v)];
      return n;
    };
    size_t coefficients = count(y.low[kLevels]);
    for (int l = 0; l < kLevels; l++)
      for (int t = 0; t < 3; t++) coefficients += count(y.high[l][t]);
    EXPECT_EQ(coefficients, size_t(std::accumulate(p.mask.begin(), p.mask.end(), 0))) << p.w << " x " << p.h;
  }
}

// Largest coefficient of the finest high bands.
double largest_high(const WaveletImage& image, int level) {
  double most = 0;
  for (int t = 0; t < 3; t++) {
    const Band& b = image.pyramid.high[level][t];
    for (uint32_t y = 0; y < b.height; y++)
      for (uint32_t x = 0; x < b.width; x++)
        if (image.mask[b.at(x, y)]) most = std::max(most, double(std::fabs(image.value[b.at(x, y)])));
  }
  return most;
}

// A slope has no detail: with the linear extension that holds at the ends of segments too. (The fourth step
// mirrors, which bends the low band at the ends, so the coarser levels see a little.) Segments of less than
// four samples are too short.
TEST(Wavelet, SlopesHaveNoDetail) {
  for (auto [w, h] : {std::pair{64u, 64u}, {37u, 53u}, {16u, 9u}}) {
    Picture p = {w, h, std::vector<uint8_t>(size_t(w) * h, 1)};
    std::vector<float> z(p.mask.size());
    for (uint32_t y = 0; y < h; y++)
      for (uint32_t x = 0; x < w; x++) {
        // a shape with slanting sides, each row and column of it one segment of at least four samples
        p.mask[size_t(y) * w + x] = x >= y / 8 && x + y / 8 < w && y >= x / 8;
        z[size_t(y) * w + x] = 100 + 3.0f * float(x) - 2.0f * float(y);
      }
    const WaveletImage image = forward_wavelet(w, h, p.mask.data(), z.data());
    EXPECT_LT(largest_high(image, 0), 0.35) << w << " x " << h;
  }
}

TEST(Wavelet, ConstantsHaveNoDetailOnAnyMask) {
  Random random(13);
  for (const Picture& p : random_pictures(random)) {
    const std::vector<float> z(p.mask.size(), 1000.0f);
    const WaveletImage image = forward_wavelet(p.w, p.h, p.mask.data(), z.data());
    EXPECT_LT(largest_high(image, 0), 1.0) << p.w << " x " << p.h;
  }
}

// --- coefficients ---

struct CodedBands {
  WaveletImage image;
  std::vector<int32_t> q;
};

TEST(Coefficients, RoundTrip) {
  Random random(14);
  std::vector<CodedBands> all;
  for (const Picture& p : random_pictures(random)) {
    CodedBands c;
    const std::vector<float> z = random_heights(random, p, 200);
    c.image = forward_wavelet(p.w, p.h, p.mask.data(), z.data());
    c.q.assign(c.image.pyramid.size, 0);
    all.push_back(std::move(c));
  }
  auto models = std::make_unique<CoefficientModels>(), learner = std::make_unique<CoefficientModels>();
  models->init();
  learner->init();
  RangeEncoder encoder;
  const float step = 2;
  for (CodedBands& c : all) {
    quantise_low(c.image, step, c.q.data());
    code_low(encoder, *models, c.image.pyramid, c.q.data(), c.image.mask.data());
  }
  for (int l = kLevels - 1; l >= 0; l--)
    for (CodedBands& c : all)
      for (int t = 0; t < 3; t++) {
        quantise_by_trellis(*learner, c.image, l, t, step, 0.3f, c.q.data());
        const std::vector<int32_t> quantised = c.q;
        code_band(encoder, *models, c.image.pyramid, c.q.data(), c.image.mask.data(), l, t);
        ASSERT_EQ(c.q, quantised) << "values that no state has";
      }
  const std::vector<uint8_t> bytes = encoder.finish();

  RangeDecoder decoder(bytes.data(), bytes.size(), false);
  models->init();
  std::vector<std::vector<int32_t>> q;
  for (CodedBands& c : all) {
    q.emplace_back(c.image.pyramid.size, 0);
    ASSERT_TRUE(code_low(decoder, *models, c.image.pyramid, q.back().data(), c.image.mask.data()));
  }
  for (int l = kLevels - 1; l >= 0; l--)
    for (size_t i = 0; i < all.size(); i++)
      for (int t = 0; t < 3; t++) {
        ASSERT_TRUE(
            code_band(decoder, *models, all[i].image.pyramid, q[i].data(), all[i].image.mask.data(), l, t));
      }
  size_t nonzero = 0;
  for (size_t i = 0; i < all.size(); i++) {
    ASSERT_EQ(q[i], all[i].q) << "image " << i;
    for (int32_t v : q[i]) nonzero += v != 0;
  }
  EXPECT_GT(nonzero, 1000u);
}

// Magnitudes beyond the unary part.
TEST(Coefficients, LargeOnesRoundTrip) {
  const Pyramid p = pyramid_of(64, 64);
  std::vector<uint8_t> mask(p.size, 0);
  for (uint32_t y = 0; y < 64; y++)
    for (uint32_t x = 0; x < 64; x++) mask[p.low[0].at(x, y)] = 1;
  std::vector<uint8_t> scratch(2 * 64 * 64 + 8 * 64 + 64);
  build_masks(p, mask.data(), scratch.data());
  Random random(15);
  std::vector<int32_t> q(p.size, 0);
  const Band& b = p.high[0][2];
  int state = 0;
  for (uint32_t y = 0; y < b.height; y++)
    for (uint32_t x = 0; x < b.width; x++) {
      const int32_t k = int32_t(random() >> (13 + random() % 19)), v = k ? 2 * k - quantiser_of(state) : 0;
      q[b.at(x, y)] = random() & 1 ? v : -v;
      state = next_state(state, k);
    }
  auto models = std::make_unique<CoefficientModels>();
  models->init();
  RangeEncoder encoder;
  std::vector<int32_t> written = q;
  code_band(encoder, *models, p, written.data(), mask.data(), 0, 2);
  EXPECT_EQ(written, q);
  const std::vector<uint8_t> bytes = encoder.finish();
  models->init();
  RangeDecoder decoder(bytes.data(), bytes.size(), false);
  std::vector<int32_t> read(p.size, 0);
  ASSERT_TRUE(code_band(decoder, *models, p, read.data(), mask.data(), 0, 2));
  EXPECT_EQ(read, q);
}

// Squared error, in squared steps of the scalar quantiser, and bits.
struct Cost {
  double squared = 0, bits = 0;
  double at(float trade) const { return squared + trade * bits; }
};

Cost scalar_cost(const WaveletImage& image, float step, float trade) {
  auto models = std::make_unique<CoefficientModels>();
  models->init();
  CountingCoder coder;
  std::vector<int32_t> q(image.pyramid.size, 0);
  double squared = 0;
  for (int l = kLevels - 1; l >= 0; l--)
    for (int t = 0; t < 3; t++) squared += estimate_band(coder, *models, image, l, t, step, trade, q.data());
  return {squared / (step * step), coder.bits()};
}

Cost trellis_cost(const WaveletImage& image, float step, float trade) {
  auto models = std::make_unique<CoefficientModels>(), learner = std::make_unique<CoefficientModels>();
  models->init();
  learner->init();
  CountingCoder coder;
  std::vector<int32_t> q(image.pyramid.size, 0);
  double squared = 0;
  for (int l = kLevels - 1; l >= 0; l--)
    for (int t = 0; t < 3; t++) {
      squared +=
          quantise_by_trellis(*learner, image, l, t, kTrellisStep * step, trellis_trade(trade), q.data());
      code_band(coder, *models, image.pyramid, q.data(), image.mask.data(), l, t);
    }
  return {squared / (step * step), coder.bits()};
}

// In D + trade * R rounding by rate and distortion beats plain rounding, and the trellis beats that; with the
// exchange rate that the steps are made for, by bits alone.
TEST(Coefficients, TheTrellisBeatsRoundingByRateAndDistortionWhichBeatsRounding) {
  Random random(16);
  double scalar_total = 0, plain_total = 0;
  for (float trade : {0.05f, 0.11f, 0.2f}) {
    Cost trellis, scalar;
    double plain = 0;
    auto add = [](Cost& sum, const Cost& c) { sum.squared += c.squared, sum.bits += c.bits; };
    for (int round = 0; round < 12; round++) {
      const uint32_t w = 40 + random() % 80, h = 40 + random() % 80;
      const Picture p = {w, h, random_mask(random, w, h)};
      const std::vector<float> z = random_heights(random, p, 30);
      const WaveletImage image = forward_wavelet(w, h, p.mask.data(), z.data());
      const float step = 4;
      add(trellis, trellis_cost(image, step, trade));
      add(scalar, scalar_cost(image, step, trade));
      plain += scalar_cost(image, step, 0).at(trade);
    }
    scalar_total += scalar.at(trade), plain_total += plain;
    EXPECT_LT(trellis.at(trade), 0.96 * scalar.at(trade));
    if (trade == 0.11f) {
      EXPECT_LT(trellis.bits, 0.97 * scalar.bits);
      EXPECT_LT(trellis.squared, scalar.squared);
    }
  }
  EXPECT_LT(scalar_total, 0.98 * plain_total);
}

// The error that the trellis returns is that of the decoder's values; every band's counts in units of its
// own step.
TEST(Coefficients, ReportedErrorIsTheDecodersError) {
  Random random(17);
  const Picture p = {60, 60, random_mask(random, 60, 60)};
  const std::vector<float> z = random_heights(random, p, 50);
  const WaveletImage image = forward_wavelet(p.w, p.h, p.mask.data(), z.data());
  auto models = std::make_unique<CoefficientModels>();
  models->init();
  std::vector<int32_t> q(image.pyramid.size, 0);
  const float step = 3;
  for (int l = kLevels - 1; l >= 0; l--)
    for (int t = 0; t < 3; t++) {
      const double reported = quantise_by_trellis(*models, image, l, t, step, 0.3f, q.data());
      double squared = 0;
      const Band& b = image.pyramid.high[l][t];
      for (uint32_t y = 0; y < b.height; y++)
        for (uint32_t x = 0; x < b.width; x++) {
          const size_t i = b.at(x, y);
          if (image.mask[i])
            squared +=
                std::pow((image.value[i] - dequantise(q[i], step * band_step(l, t))) / band_step(l, t), 2);
        }
      EXPECT_NEAR(reported, squared, 1e-3 * squared + 1e-6) << l << ", " << t;
    }
}

// --- bisk ---

// Patches to code with bisk, all with the same spacing and step, and the decoder's side of them.
struct BiskPatches {
  std::vector<Picture> pictures;
  std::vector<std::vector<float>> z;
  std::vector<WaveletImage> images;
  std::vector<CodedPatch> coded;
  StreamPlacement placement = {{0, 0, 0}, 1e-6f, 1000, 1, 0.1f, false, true};

  void add(const Picture& p, std::vector<float> heights) {
    pictures.push_back(p);
    z.push_back(std::move(heights));
    images.push_back(forward_wavelet(p.w, p.h, p.mask.data(), z.back().data()));
  }
  EmbeddedCode code() {
    coded.clear();
    for (size_t i = 0; i < images.size(); i++)
      coded.push_back({{pictures[i].w, pictures[i].h, 0, 0, 0, 0, 0, 0, 0},
                       pictures[i].mask.data(),
                       &images[i],
                       z[i].data(),
                       nullptr});
    return code_bisk(coded, placement);
  }

  // What a prefix decodes to, patch after patch.
  std::vector<std::vector<int32_t>> decode(const std::vector<uint8_t>& bytes, size_t size) const {
    std::vector<PatchHeader> headers;
    std::vector<PlanesBegin> begin;
    std::vector<uint8_t> mask;
    size_t pixels = 0;
    for (const CodedPatch& c : coded) {
      headers.push_back(c.header);
      begin.push_back({mask.size(), mask.size(), 0});
      mask.insert(mask.end(), c.image->mask.begin(), c.image->mask.end());
      for (size_t i = 0; i < size_t(c.header.width) * c.header.height; i++) pixels += c.mask[i];
    }
    std::vector<int32_t> q(mask.size(), 0);
    BiskState state;
    std::vector<BiskPatch> at(coded.size());
    std::vector<BiskSet> sets(pixels);
    const BiskPlanes planes = {
        headers.data(), uint32_t(headers.size()), begin.data(), mask.data(), q.data(), &state, at.data(),
        sets.data()};
    const HeapBlock exact(bytes.data(), size);
    RangeDecoder coder(exact.data(), size, false);
    start_bisk(planes);
    while (advance_bisk(coder, planes)) {
    }
    std::vector<std::vector<int32_t>> all;
    for (size_t i = 0; i < coded.size(); i++)
      all.emplace_back(q.begin() + ptrdiff_t(begin[i].q),
                       q.begin() + ptrdiff_t(begin[i].q + coded[i].image->pyramid.size));
    return all;
  }

  // Calls visit(patch, coefficient in steps of its band, index in the patch's planes).
  template <class Visit>
  void each(Visit visit) const {
    for (size_t i = 0; i < images.size(); i++)
      for (int number = 0; number < kBands; number++) {
        const Band& b = band_of(images[i].pyramid, number);
        const float step = number == 0 ? 1 : band_step(kLevels - 1 - (number - 1) / 3, (number - 1) % 3);
        for (uint32_t y = 0; y < b.height; y++)
          for (uint32_t x = 0; x < b.width; x++)
            if (images[i].mask[b.at(x, y)])
              visit(i, images[i].value[b.at(x, y)] / (step * placement.step), b.at(x, y));
      }
  }

  std::vector<double> squared_errors(const std::vector<uint8_t>& bytes, size_t size) const {
    const auto q = decode(bytes, size);
    std::vector<double> sum(images.size(), 0);
    each([&](size_t patch, float v, size_t i) { sum[patch] += std::pow(v - q[patch][i], 2); });
    return sum;
  }
};

double total(const std::vector<double>& v) { return std::accumulate(v.begin(), v.end(), 0.0); }

BiskPatches random_bisk_patches(uint32_t seed) {
  Random random(seed);
  BiskPatches b;
  for (const Picture& p : random_pictures(random)) b.add(p, random_heights(random, p, 200));
  return b;
}

TEST(Bisk, TheWholeCodeHoldsEveryCoefficient) {
  for (bool even : {false, true}) {
    BiskPatches b = random_bisk_patches(31);
    b.placement.even = even;
    const EmbeddedCode code = b.code();
    const auto q = b.decode(code.bytes, code.bytes.size());
    size_t nonzero = 0;
    b.each([&](size_t patch, float v, size_t i) {
      EXPECT_LE(std::fabs(v - float(q[patch][i])), 0.54f) << patch;
      nonzero += q[patch][i] != 0;
    });
    EXPECT_GT(nonzero, 1000u);
    EXPECT_LT(code.at_trade, code.bytes.size());
  }
}

// Whatever the byte at which the code is cut. A byte alone may add a little: the middle of an interval is not
// always nearer than that of the one it is in.
TEST(Bisk, EveryPrefixDecodesAndLongerOnesAreNearer) {
  BiskPatches b = random_bisk_patches(32);
  const EmbeddedCode code = b.code();
  const double nothing = total(b.squared_errors(code.bytes, 0));
  double last = nothing;
  for (size_t n = 1; n <= code.bytes.size(); n += n < 100 ? 1 : 61) {
    const double now = total(b.squared_errors(code.bytes, n));
    ASSERT_LE(now, last * 1.1) << n;
    last = now;
  }
  EXPECT_LT(last, 1e-4 * nothing);
  for (int part = 1; part < 16; part++) {
    const size_t end = code.bytes.size() * size_t(part) / 16,
                 begin = code.bytes.size() * size_t(part - 1) / 16;
    EXPECT_LT(total(b.squared_errors(code.bytes, end)), 0.9 * total(b.squared_errors(code.bytes, begin)))
        << part;
  }
}

// Two patches alike but for the heights: the rough one takes the more bits if they go where they help most,
// and that errs less for the same bytes; evenly, both are coded alike (3.6).
TEST(Bisk, AllocationByRateAndDistortionBeatsTheEvenOne) {
  Random random(33);
  const Picture p = {64, 64, std::vector<uint8_t>(64 * 64, 1)};
  BiskPatches b;
  b.add(p, random_heights(random, p, 400));
  std::vector<float> smooth = random_heights(random, p, 400);
  for (float& z : smooth) z /= 32;
  b.add(p, smooth);
  const EmbeddedCode rd = b.code();
  b.placement.even = true;
  const EmbeddedCode even = b.code();
  for (size_t n : {even.bytes.size() / 4, even.bytes.size() * 3 / 8, even.bytes.size() / 2}) {
    const std::vector<double> by_rd = b.squared_errors(rd.bytes, n), evenly = b.squared_errors(even.bytes, n);
    EXPECT_LT(total(by_rd), 0.8 * total(evenly)) << n;
    EXPECT_GT(by_rd[1], evenly[1]) << n << ": the smooth patch got as many bits";
    EXPECT_LT(by_rd[0], evenly[0]) << n;
  }
}

// --- masks ---

// A patch whose surface ends at a line, at every quarter of the spacing: the mask ends within half a spacing
// of it, on either side. A hole of one pixel stays one, and so does the mask of a surface without a border.
TEST(ExtendBorder, ReachesToWithinHalfASpacing) {
  constexpr uint32_t kWidth = 12, kHeight = 9;
  for (uint32_t end = 5 * kOversampling; end < 6 * kOversampling; end++) {
    ElevationMap map;
    map.spacing = 1, map.width = kWidth, map.height = kHeight;
    FineRaster fine;
    fine.width = (kWidth - 1) * kOversampling + 1, fine.height = (kHeight - 1) * kOversampling + 1;
    fine.owner.assign(size_t(fine.width) * fine.height, 0);
    fine.z.assign(fine.owner.size(), NAN);
    for (uint32_t y = 0; y < fine.height; y++)
      for (uint32_t x = 0; x <= end; x++)
        if (x != 2 * kOversampling || y != 4 * kOversampling)  // else a hole
          fine.owner[y * fine.width + x] = 1, fine.z[y * fine.width + x] = float(x);
    map.mask.assign(size_t(kWidth) * kHeight, 0);
    map.z.assign(map.mask.size(), 0);
    map.face.assign(map.mask.size(), -1);
    for (uint32_t y = 0; y < kHeight; y++)
      for (uint32_t x = 0; x < kWidth; x++) {
        const size_t at = (size_t(y) * fine.width + x) * kOversampling;
        if (!fine.owner[at]) continue;
        map.mask[y * kWidth + x] = 1, map.face[y * kWidth + x] = 0;
        map.z[y * kWidth + x] = fine.z[at];
        map.pixels++;
      }
    const ElevationMap before = map;
    extend_border(map, fine, {});
    EXPECT_EQ(map.mask, before.mask);
    extend_border(map, fine, {0.0f});
    EXPECT_EQ(map.mask[4 * kWidth + 2], 0) << "the hole";
    size_t pixels = 0;
    for (uint32_t y = 0; y < kHeight; y++)
      for (uint32_t x = 0; x < kWidth; x++) {
        const bool in = map.mask[y * kWidth + x];
        pixels += in;
        if (x == 2 && y == 4) continue;
        const double beyond = double(x) - double(end) / kOversampling;
        EXPECT_EQ(in, beyond <= 0.5) << x << ' ' << y;
        if (!in) continue;
        EXPECT_EQ(map.z[y * kWidth + x], float(std::min(x * kOversampling, end))) << "the nearest point's";
        EXPECT_EQ(map.face[y * kWidth + x], 0);
      }
    EXPECT_EQ(map.pixels, pixels);
  }
}

// Single pixels that stick out of a straight border are gone, and notches are filled; not so along the end of
// the surface, and a corner keeps all but its tip.
TEST(SmoothBorder, TakesAwayJitterButNotAlongTheSurfacesEnd) {
  ElevationMap map;
  map.width = 20, map.height = 14;
  map.mask.assign(20 * 14, 0);
  map.z.assign(map.mask.size(), 0);
  FineRaster fine;
  fine.width = 19 * kOversampling + 1, fine.height = 13 * kOversampling + 1;
  fine.owner.assign(size_t(fine.width) * fine.height, 2);
  auto pixel = [&](int x, int y) -> uint8_t& { return map.mask[size_t(y * 20 + x)]; };
  for (int y = 0; y < 14; y++)
    for (int x = 0; x < 20; x++) {
      pixel(x, y) = y >= 4 && x < 16;
      if (y < 4 && x < 6) fine.owner[(size_t(y) * fine.width + size_t(x)) * kOversampling] = 0;
    }
  const std::vector<uint8_t> straight = map.mask;
  pixel(3, 3) = 1, pixel(4, 4) = 0;   // at the surface's end
  pixel(9, 3) = 1, pixel(12, 4) = 0;  // between patches
  pixel(16, 9) = 1, pixel(15, 11) = 0;
  smooth_border(map, fine);
  EXPECT_EQ(pixel(3, 3), 1);
  EXPECT_EQ(pixel(4, 4), 0);
  pixel(3, 3) = 0, pixel(4, 4) = 1;
  EXPECT_EQ(pixel(15, 4), 0);  // the corner's tip
  pixel(15, 4) = 1;
  EXPECT_EQ(map.mask, straight);
}

// --- streams ---

// A stream of flat patches with the given masks (clean ones), through the whole encoder's writing.
struct Built {
  std::vector<ElevationMap> maps;
  std::vector<WaveletImage> images;
  StreamPlacement placement = {{0, 0, 0}, 1e-6f, 1000, 8, 0.1f, false};
  std::vector<CodedPatch> patches;
  QuantisedImages quantised;
  StreamParts parts;
};

Built build(std::vector<Picture> pictures, Random& random) {
  Built b;
  for (const Picture& p : pictures) {
    ElevationMap map;
    map.width = p.w, map.height = p.h;
    map.mask = p.mask;
    map.z = random_heights(random, p, 500);
    drop_unmeshable(map);
    if (map.pixels >= 3) b.maps.push_back(std::move(map));
  }
  for (const ElevationMap& m : b.maps)
    b.images.push_back(forward_wavelet(m.width, m.height, m.mask.data(), m.z.data()));
  for (size_t i = 0; i < b.maps.size(); i++)
    b.patches.push_back({{b.maps[i].width, b.maps[i].height, int32_t(100 * i), 0, 0, 0, 0, 0, 0},
                         b.maps[i].mask.data(),
                         &b.images[i],
                         b.maps[i].z.data(),
                         nullptr});
  b.parts = code_stream(b.patches, b.placement, b.quantised);
  return b;
}

// Mending looks at patches that are meshed each alone: that is what their stream decodes to, also when some
// of them are others than before.
TEST(Stream, PatchesMeshedAloneAreThoseOfTheDecoder) {
  Random random(23);
  int compared = 0;
  for (int round = 0; round < 30; round++) {
    std::vector<Picture> pictures;
    for (int i = 0; i < 6; i++) {
      const uint32_t w = 2 + random() % 60, h = 2 + random() % 60;
      pictures.push_back({w, h, random_mask(random, w, h)});
    }
    Built b = build(pictures, random);
    if (b.maps.size() < 2) continue;
    for (CodedPatch& p : b.patches) {
      p.header.step_index = int32_t(random() % 5) - 2, p.header.spacing_index = int32_t(random() % 3);
      p.header.u = int32_t(random() % 200) - 100, p.header.z0 = int32_t(random() % 50) - 25;
    }
    MeshedPatches meshed;
    const std::vector<CodedPatch> some(b.patches.begin() + 1, b.patches.end());
    for (const auto& patches : {b.patches, some}) {
      const StreamParts parts = code_stream(patches, b.placement, b.quantised);
      PatchDecoder decoder(assemble(parts, {parts.boundary_nodes, 0, 0}, {}));
      PatchDecoder alone(meshed.of(patches, b.placement, b.quantised), b.placement);
      const DecodedMesh is = alone.close(Seams()), should = decoder.close(Seams());
      EXPECT_EQ(is.mesh.positions, should.mesh.positions) << "round " << round;
      EXPECT_EQ(is.mesh.triangles, should.mesh.triangles) << "round " << round;
      EXPECT_EQ(is.links, should.links) << "round " << round;
      EXPECT_EQ(is.nodes, should.nodes) << "round " << round;
      EXPECT_EQ(alone.open().components, decoder.open().components) << "round " << round;
      compared++;
    }
  }
  EXPECT_GT(compared, 40);
}

// The number of border vertices is promised by the header and checked by the decoder: CORRUPT if it is off by
// one.
TEST(Stream, BoundaryNodesAreThoseOfTheDecoder) {
  Random random(18);
  int decoded = 0;
  for (int round = 0; round < 200; round++) {
    std::vector<Picture> pictures;
    const uint32_t w = 2 + random() % 40, h = 2 + random() % 40;
    if (round % 2) {
      pictures.push_back({w, h, random_mask(random, w, h)});
    } else {  // noise, of all densities: every pattern of cells around a pixel
      Picture p = {w, h, std::vector<uint8_t>(size_t(w) * h)};
      const double density = 0.3 + 0.7 * uniform(random);
      for (uint8_t& m : p.mask) m = uniform(random) < density;
      pictures.push_back(std::move(p));
    }
    const Built b = build(pictures, random);
    if (b.maps.empty()) continue;
    EXPECT_EQ(b.parts.boundary_nodes,
              count_boundary_nodes(b.maps[0].mask.data(), b.maps[0].width, b.maps[0].height));
    for (int off : {0, 1, -1}) {
      const StreamCounts counts = {b.parts.boundary_nodes + uint32_t(off), 0, 0};
      const std::vector<uint8_t> stream = assemble(b.parts, counts, {});
      const Decoded d = decode_exactly(stream.data(), stream.size());
      ASSERT_EQ(d.status, off ? RELIEF_ERROR_CORRUPT : RELIEF_OK) << "round " << round << ", off by " << off;
      if (!off) {
        EXPECT_EQ(fault_of(d), "") << "round " << round;
        decoded++;
      }
    }
  }
  EXPECT_GT(decoded, 150);
}

// Not one of these may be taken: each is a way to ask for too much, or for positions that are not finite.
TEST(Stream, ExtremeFieldsOfTheHeader) {
  Random random(19);
  const Built b = build({{20, 20, std::vector<uint8_t>(400, 1)}}, random);
  const StreamCounts good = {b.parts.boundary_nodes, 400, 722};
  auto status = [&](auto change) {
    StreamParts parts = b.parts;
    StreamCounts counts = good;
    change(parts, counts);
    const std::vector<uint8_t> stream = assemble(parts, counts, {});
    const Decoded d = decode_exactly(stream.data(), stream.size());
    EXPECT_EQ(d.status == RELIEF_OK ? fault_of(d) : "", "");
    return d.inspected;
  };
  EXPECT_EQ(status([](StreamParts&, StreamCounts&) {}), RELIEF_OK);
  const float bad[] = {NAN, INFINITY, -INFINITY, 0.0f, -0.0f, 1e-45f, -1.0f, 3.4e38f, 1e-39f};
  for (float f : bad) {
    EXPECT_EQ(status([f](StreamParts& p, StreamCounts&) { p.placement.spacing = f; }), RELIEF_ERROR_CORRUPT)
        << f;
    EXPECT_EQ(status([f](StreamParts& p, StreamCounts&) { p.placement.step = f; }), RELIEF_ERROR_CORRUPT)
        << f;
    EXPECT_EQ(status([f](StreamParts& p, StreamCounts&) { p.placement.scale = f; }), RELIEF_ERROR_CORRUPT)
        << f;
  }
  for (float f : {NAN, INFINITY, -INFINITY, 3.4e38f, -3.4e38f})
    for (int k = 0; k < 3; k++)
      EXPECT_EQ(status([=](StreamParts& p, StreamCounts&) { p.placement.origin[k] = f; }),
                RELIEF_ERROR_CORRUPT)
          << f;
  for (uint32_t n : {0u, 1u << 16, 1u << 20, 1u << 21, 0x7fffffffu, 0xffffffffu}) {
    EXPECT_NE(status([n](StreamParts& p, StreamCounts&) { p.patches = n; }), RELIEF_OK) << n;
    EXPECT_NE(status([n](StreamParts& p, StreamCounts&) { p.mask_pixels = n; }), RELIEF_OK) << n;
  }
  for (uint32_t n : {1u << 16, 1u << 28, 0x7fffffffu, 0xffffffffu}) {
    EXPECT_NE(status([n](StreamParts&, StreamCounts& c) { c.boundary_nodes = n; }), RELIEF_OK) << n;
    EXPECT_NE(status([n](StreamParts&, StreamCounts& c) { c.vertices = n; }), RELIEF_OK) << n;
    EXPECT_NE(status([n](StreamParts&, StreamCounts& c) { c.triangles = n; }), RELIEF_OK) << n;
  }
}

// The largest rectangles that a few bytes can ask for: over the default limits, and refused before they are
// sized.
TEST(Stream, HugeRectanglesAreOverTheLimit) {
  for (uint32_t side : {kMaxSide, kMaxSide / 2 + 1}) {
    RangeEncoder coder;
    PatchTableModels models;
    PatchHeader patch = {};
    patch.width = patch.height = side;
    for (int i = 0; i < 4; i++) code_patch(coder, models, patch);
    StreamParts parts;
    parts.placement = {{0, 0, 0}, 1e-6f, 1000, 8, 0.1f, true};
    parts.patches = 4, parts.mask_pixels = 100;
    parts.table = coder.finish();
    parts.table.resize(parts.table.size() + 100);
    const std::vector<uint8_t> stream = assemble(parts, {50, 0, 0}, {});
    relief_info info;
    EXPECT_EQ(relief_inspect(stream.data(), stream.size(), nullptr, &info), RELIEF_ERROR_LIMIT) << side;
  }
}

// A stream of 1 KB that asks for as much as it can: `count` rectangles, every pixel in a mask and on a
// border.
std::vector<uint8_t> greedy_stream(uint32_t count, uint32_t width, uint32_t height, uint32_t most) {
  RangeEncoder coder;
  PatchTableModels models;
  PatchHeader patch = {};
  patch.width = width, patch.height = height;
  for (uint32_t i = 0; i < count; i++) code_patch(coder, models, patch);
  StreamParts parts;
  parts.placement = {{0, 0, 0}, 1e-6f, 1000, 8, 0.1f, true};
  parts.patches = count;
  parts.mask_pixels = uint32_t(std::min<uint64_t>(uint64_t(count) * width * height, most));
  parts.table = coder.finish();
  parts.table.resize(1000);
  return assemble(parts, {parts.mask_pixels, 0, 0}, {});
}

// Memory of the caller: workspace, positions, normals, indices.
uint64_t memory_of(const relief_info& info) {
  return info.workspace_bytes + 24 * uint64_t(info.vertex_capacity) + 12 * uint64_t(info.triangle_capacity);
}

// The memory that 1 KB can ask for grows with the limits alone: a megabyte, 3400 bytes a patch, 96 a pixel,
// and 950 a vertex. So limits of a million of each keep it below 1.1 GB, and those of 2^16 below 80 MB.
TEST(Stream, AsksForNoMoreThanTheLimitsAllow) {
  int taken = 0;
  uint64_t most = 0;
  for (uint32_t pixels : {1u << 10, 1u << 16, 1u << 20})
    for (uint32_t vertices : {1u << 10, 1u << 16, 1u << 20})
      for (uint32_t width : {1u, 2u, 3u, 33u, 1000u, kMaxSide})
        for (uint32_t height : {1u, 2u, 3u, 33u, 1000u, kMaxSide})
          for (uint32_t count : {1u, 2u, 30u, 1000u}) {
            const std::vector<uint8_t> stream = greedy_stream(count, width, height, vertices);
            ASSERT_LE(stream.size(), 1060u);
            const relief_limits limits = {1000, pixels, vertices, UINT64_MAX};
            relief_options options = {&limits, nullptr, 0, 0, 0, 0, 0};
            relief_info info;
            const relief_status status = relief_inspect(stream.data(), stream.size(), &options, &info);
            if (status != RELIEF_OK) continue;
            taken++;
            most = std::max(most, memory_of(info));
            EXPECT_LE(memory_of(info),
                      (1u << 20) + 3400 * 1000 + 96 * uint64_t(pixels) + 950 * uint64_t(vertices))
                << count << " of " << width << " x " << height;
          }
  EXPECT_GT(taken, 100);
  EXPECT_LT(most, 1100000000u);
  EXPECT_GT(most, 500000000u);  // they do ask for much
}

// The least max_memory with which a stream passes, by bisection; 0: the default does.
uint64_t memory_needed(const std::vector<uint8_t>& stream, const relief_options& given) {
  relief_limits limits = {UINT32_MAX, UINT32_MAX, UINT32_MAX, 0};
  relief_options options = given;
  options.limits = &limits;
  relief_info info;
  uint64_t few = 1, many = uint64_t(1) << 60;
  while (many - few > 1) {
    limits.max_memory = few + (many - few) / 2;
    const relief_status status = relief_inspect(stream.data(), stream.size(), &options, &info);
    (status == RELIEF_OK ? many : few) = limits.max_memory;
  }
  return many;
}

// The formula is above what is needed, whatever the options, and not far above with the default ones.
TEST(Stream, TheMemoryItAsksForIsKnownBeforehand) {
  for (uint32_t vertices : {1u << 10, 1u << 16, 1u << 20})
    for (uint32_t width : {1u, 2u, 3u, 17u, 33u, 1000u, kMaxSide})
      for (uint32_t height : {1u, 2u, 3u, 17u, 33u, 1000u, kMaxSide})
        for (uint32_t count : {1u, 30u, 200u}) {
          const uint64_t pixels = uint64_t(width) * height * count;
          if (pixels < 3 || pixels > 1 << 28) continue;
          const std::vector<uint8_t> stream = greedy_stream(count, width, height, vertices);
          const uint64_t bound = memory_needed(stream, {});
          const relief_limits limits = {UINT32_MAX, UINT32_MAX, UINT32_MAX, bound};
          for (uint32_t flags : {0, int(RELIEF_POINTS), RELIEF_QUANTISED | RELIEF_INDICES_16})
            for (uint32_t level : {0, RELIEF_MAX_LEVEL}) {
              relief_options options = {&limits, nullptr, level, flags, 0, 0, 0};
              relief_info info;
              ASSERT_EQ(relief_inspect(stream.data(), stream.size(), &options, &info), RELIEF_OK)
                  << count << " of " << width << " x " << height;
              ASSERT_LE(memory_of(info), bound)
                  << count << " of " << width << " x " << height << ", " << flags;
              if (flags == 0 && level == 0) {
                EXPECT_LE(bound, 3 * memory_of(info) + (1 << 23))
                    << count << " of " << width << " x " << height;
              }
            }
        }
}

// The default limits allow a stream 1 GiB and 64 KiB for each of its bytes; the library and the command say
// so too.
TEST(Stream, GigabytesForAKilobyteAreRefused) {
  for (const std::vector<uint8_t>& stream :
       {greedy_stream(1, kMaxSide, 1 << 13, 1 << 27), greedy_stream(1, 4096, 1024, 1 << 22)}) {
    const uint64_t needed = memory_needed(stream, {}), allowed = (uint64_t(1) << 30) + (stream.size() << 16);
    EXPECT_GT(needed, uint64_t(3) << 30);
    relief_info info;
    EXPECT_EQ(relief_inspect(stream.data(), stream.size(), nullptr, &info), RELIEF_ERROR_LIMIT);
    EXPECT_THROW(decode(stream.data(), stream.size()), InputError);
    relief_limits limits = relief_default_limits;
    relief_options options = {&limits, nullptr, 0, 0, 0, 0, 0};
    for (uint64_t memory : {uint64_t(0), allowed, needed - 1}) {
      limits.max_memory = memory;
      EXPECT_EQ(relief_inspect(stream.data(), stream.size(), &options, &info), RELIEF_ERROR_LIMIT);
    }
    limits.max_memory = needed;
    EXPECT_EQ(relief_inspect(stream.data(), stream.size(), &options, &info), RELIEF_OK);
  }
  // just below and above the default: nodes cost 1200 bytes, the step of this search
  bool refused = false, passed = false;
  for (uint32_t vertices = 1 << 19; vertices < 1 << 20; vertices += 1 << 12) {
    const std::vector<uint8_t> stream = greedy_stream(1, 1024, 1024, vertices);
    relief_info info;
    const bool over = memory_needed(stream, {}) > (uint64_t(1) << 30) + (stream.size() << 16);
    EXPECT_EQ(relief_inspect(stream.data(), stream.size(), nullptr, &info),
              over ? RELIEF_ERROR_LIMIT : RELIEF_OK);
    (over ? refused : passed) = true;
  }
  EXPECT_TRUE(refused && passed);
}

TEST(Ledger, AddsUpToTheStream) {
  for (const Golden& g : read_golden(RELIEF_SOURCE_DIR "/tests/golden")) {
    const Ledger l = read_ledger(g.stream);
    EXPECT_EQ(l.header + l.side + l.masks + l.coefficients + l.seams + l.colours, g.stream.size()) << g.name;
    const std::vector<uint64_t>& parts = l.by_plane.empty() ? l.by_level : l.by_plane;
    EXPECT_EQ(std::accumulate(parts.begin(), parts.end(), uint64_t(0)), l.coefficients) << g.name;
    EXPECT_EQ(g.stream[4] & kFlagBisk ? l.by_level.size() : l.by_plane.size(), 0u);
    if (l.by_plane.empty()) {
      EXPECT_EQ(l.by_level.size(), size_t(kLevels));
      ASSERT_EQ(l.by_band.size(), size_t(kLevels));
    }
    for (size_t level = 0; level < l.by_band.size(); level++) {
      const auto& bands = l.by_band[level];
      EXPECT_EQ(std::accumulate(bands.begin(), bands.end(), uint64_t(0)), l.by_level[level]) << g.name;
      if (level > 0) {
        EXPECT_EQ(bands[0], 0u) << g.name << ": only the coarsest level has LL";
      }
    }
    const Decoded d = decode_exactly(g.stream.data(), g.stream.size());
    ASSERT_EQ(l.patches.size(), d.info.patch_count) << g.name;
    uint64_t rectangles = 0, pixels = 0, masks = 0, coefficients = 0;
    for (const Ledger::P& p : l.patches) {
      rectangles += uint64_t(p.width) * p.height, pixels += p.pixels;
      masks += p.masks, coefficients += p.coefficients;
      EXPECT_GT(p.spacing, 0);
      EXPECT_NEAR(std::hypot(p.normal[0], p.normal[1], p.normal[2]), 1, 1e-9);
    }
    EXPECT_EQ(masks, l.masks) << g.name;
    EXPECT_EQ(coefficients, l.coefficients) << g.name;
    EXPECT_EQ(rectangles, d.info.pixel_count) << g.name;
    EXPECT_LE(pixels, d.vertices()) << g.name;
  }
}

TEST(Ledger, RefusesWhatIsNotAWholeStream) {
  for (const Golden& g : read_golden(RELIEF_SOURCE_DIR "/tests/golden"))
    for (size_t n = 0; g.closed && n < g.stream.size(); n += 7)
      EXPECT_THROW(read_ledger({g.stream.begin(), g.stream.begin() + ptrdiff_t(n)}), InputError)
          << g.name << ", " << n;
}

}  // namespace
}  // namespace relief
