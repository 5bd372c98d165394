// Prefixes of streams: the more bytes, the nearer the surface.
#include <gtest/gtest.h>

#include "closed_shapes.h"
#include "decoded.h"
#include "measure/surface_error.h"
#include "measure/topology.h"

namespace relief {
namespace {

constexpr size_t kSamples = 200000;

struct Case {
  const char* shape;
  Coder coder = Coder::kSubband;
  Allocation allocation = Allocation::kRateDistortion;
};

std::string name_of(const Case& c) {
  std::string name = c.shape;
  std::replace(name.begin(), name.end(), ' ', '_');
  if (c.coder == Coder::kBisk) name += c.allocation == Allocation::kEven ? "_bisk_even" : "_bisk";
  return name;
}

void PrintTo(const Case& c, std::ostream* out) { *out << name_of(c); }

ClosedShape shape(const std::string& name) {
  for (const ClosedShape& s : closed_shapes())
    if (s.name == name) return s;
  throw std::runtime_error("no shape " + name);
}

// The error falls from each share of the coefficients to the next, and no prefix has a border or a crack.
void expect_error_falls(const TriangleMesh& mesh, const std::vector<uint8_t>& stream,
                        const std::string& what) {
  const ErrorMeter meter(mesh, kSamples);
  const size_t begin = decode_exactly(stream.data(), stream.size()).info.masks_end;
  double last = INFINITY;
  for (int percent : {10, 25, 50, 75, 90, 100}) {
    const size_t n = begin + (stream.size() - begin) * size_t(percent) / 100;
    const TriangleMesh part = decode(stream.data(), n);
    const double error = meter.measure(part).rms;
    EXPECT_LT(error, last) << what << ", " << percent << "%";
    last = error;
    const Topology t = topology(part);
    EXPECT_EQ(t.open_edges + t.nonmanifold_edges + t.nonmanifold_vertices, 0u)
        << what << ", " << percent << "%";
  }
}

class Prefixes : public testing::TestWithParam<Case> {};

TEST_P(Prefixes, ErrFurtherTheShorterTheyAre) {
  const TriangleMesh mesh = shape(GetParam().shape).make();
  EncodeOptions options;
  options.error = 3e-4;
  options.coder = GetParam().coder;
  options.allocation = GetParam().allocation;
  const EncodeResult result = encode(mesh, options);
  EXPECT_TRUE(result.target_met);
  expect_error_falls(mesh, result.stream, name_of(GetParam()));
}

// Long streams, so that decoding goes on from many a place inside of bands and passes.
TEST(Arriving, InPiecesGivesTheMeshOfThePrefix) {
  for (Coder coder : {Coder::kSubband, Coder::kBisk}) {
    EncodeOptions options;
    options.error = 8e-5;
    options.coder = coder;
    const std::vector<uint8_t> s = encode(make_bumpy_sphere(6), options).stream;
    EXPECT_GT(s.size(), 2500u);
    Arriving stream;
    for (size_t n = decode_exactly(s.data(), s.size()).info.masks_end; n < s.size(); n += 1 + n * 7919 % 307)
      ASSERT_TRUE(same(stream.decode(s.data(), n), decode_exactly(s.data(), n))) << n;
    EXPECT_TRUE(same(stream.decode(s.data(), s.size()), decode_exactly(s.data(), s.size())));
  }
}

// The drilled slab and the cheese have tunnels, over which a prefix must not put lids.
constexpr Coder kBisk = Coder::kBisk;
INSTANTIATE_TEST_SUITE_P(, Prefixes,
                         testing::Values(Case{"bumpy sphere"}, Case{"torus"}, Case{"double torus"},
                                         Case{"drilled slab"}, Case{"cheese"}, Case{"cup"},
                                         Case{"bumpy sphere", kBisk}, Case{"torus", kBisk},
                                         Case{"drilled slab", kBisk}, Case{"cup", kBisk},
                                         Case{"bumpy sphere", kBisk, Allocation::kEven}),
                         [](const auto& test) { return name_of(test.param); });

}  // namespace
}  // namespace relief
