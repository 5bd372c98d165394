// What the encoder learns by decoding its own streams.
#include <gtest/gtest.h>

#include "measure/topology.h"
#include "relief/encoder.h"
#include "seams/borders.h"
#include "shapes.h"

namespace relief {
namespace {

// The border counted from trial to trial is that of the whole mesh, whichever faces between patches are open.
TEST(Borders, AreThoseOfTheMesh) {
  uint64_t most_loops = 0;
  TriangleMesh cut_torus = make_torus(72, 40);
  std::erase_if(cut_torus.triangles, [&](const auto& t) { return cut_torus.positions[t[0]][0] > 0.8f; });
  for (const TriangleMesh& mesh : {make_waves(60), make_hemisphere(24, 72), cut_torus, make_torus(72, 40)}) {
    EncodeOptions options;
    options.error = 2e-3;
    options.aperture = 30;  // several patches
    const std::vector<uint8_t> stream = encode(mesh, options).stream;
    PatchDecoder decoder(stream);
    const DecodedMesh filled = decoder.close({});
    const Borders borders(filled);
    const uint32_t faces = uint32_t(filled.first_triangle.size());
    for (uint32_t every : {1u, 2u, 3u, 7u, faces}) {
      Seams seams;
      for (uint32_t f = 0; f < faces; f += every) seams.holes.push_back(f);
      const DecodedMesh decoded = decoder.close(seams);
      const Borders::Count border = borders.count(decoded);
      const Topology whole = topology(decoded.mesh);
      ASSERT_EQ(whole.nonmanifold_edges + whole.nonmanifold_vertices, 0u);
      EXPECT_EQ(border.edges, whole.open_edges) << every;
      EXPECT_EQ(border.loops, whole.boundary_loops) << every;
      most_loops = std::max(most_loops, border.loops);
    }
  }
  EXPECT_GT(most_loops, 4u);
}

}  // namespace
}  // namespace relief
