// Prefixes of streams: the more bytes, the nearer the surface.
#include <gtest/gtest.h>

#include "closed_shapes.h"
#include "decoded.h"
#include "measure/surface_error.h"
#include "measure/topology.h"

namespace relief {
namespace {

constexpr size_t kSamples = 200000;

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
    EXPECT_EQ(t.open_edges + t.nonmanifold_edges + t.nonmanifold_vertices, 0u) << what << ", " << percent << "%";
  }
}

class Prefixes : public testing::TestWithParam<const char*> {};

TEST_P(Prefixes, ErrFurtherTheShorterTheyAre) {
  const ClosedShape s = shape(GetParam());
  EncodeOptions options;
  options.error = 3e-4;
  expect_error_falls(s.mesh, encode(s.mesh, options).stream, s.name);
}

// The drilled slab and the cheese have tunnels, over which a prefix must not put lids.
INSTANTIATE_TEST_SUITE_P(, Prefixes,
                         testing::Values("bumpy sphere", "torus", "double torus", "drilled slab", "cheese", "cup"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

}  // namespace
}  // namespace relief
