// What the encoder learns by decoding its own streams.
#include <gtest/gtest.h>

#include "measure/topology.h"
#include "relief/encoder.h"
#include "seams/borders.h"
#include "seams/folds.h"
#include "seams/mask_edits.h"
#include "shapes.h"
#include "surface/half_edges.h"

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

// Pairs of neighbours that turn over, one of them between patches at least, counted over all edges of the mesh.
size_t count_folds(const DecodedMesh& d, const Ground& ground) {
  size_t folds = 0;
  for_each_edge(d.mesh.triangles, d.mesh.positions.size(), [&](std::span<const uint32_t> edge) {
    if (edge.size() != 2 || edge[1] / 3 < d.patch_triangles()) return;
    const Vec3 m = unit_normal(d, ground, edge[0] / 3), n = unit_normal(d, ground, edge[1] / 3);
    folds += m.dot(n) < std::cos(150 * M_PI / 180);
  });
  return folds;
}

// Links that are left out make larger faces, some of which can only be closed with folds: all are found, and
// none where the surface itself is folded.
TEST(Folds, AreThoseOfTheMesh) {
  size_t most = 0;
  for (const TriangleMesh& mesh : {make_torus(72, 40), make_plate(20), make_bumpy_sphere(5)}) {
    EncodeOptions options;
    options.error = 2e-3;
    options.aperture = 30;
    const std::vector<uint8_t> stream = encode(mesh, options).stream;
    PatchDecoder decoder(stream);
    const Surface surface = build_surface(mesh);
    const Ground ground = {surface, {}, {}, {1e-6 / surface.scale}};
    const DecodedMesh plain = decoder.close({});
    const FoldFinder finder(plain, ground, folded_vertices(surface));
    for (uint32_t every : {2u, 3u, 5u}) {
      Seams seams;
      for (uint32_t l = 0; l < plain.links.size(); l += every) seams.dropped_links.push_back(l);
      const DecodedMesh decoded = decoder.close(seams);
      const std::vector<Fold> folds = finder.find(decoded);
      EXPECT_EQ(folds.size(), count_folds(decoded, ground));
      most = std::max(most, folds.size());
      for (const Fold& f : folds)
        EXPECT_LT(unit_normal(decoded, ground, f.triangle[0]).dot(unit_normal(decoded, ground, f.triangle[1])),
                  -0.8);
    }
  }
  EXPECT_GT(most, 0u);
}

// Patches of two squares of pixels side by side.
struct TwoPatches {
  std::vector<uint8_t> mask = std::vector<uint8_t>(64, 1);
  std::vector<float> z = std::vector<float>(64, 3.0f);
  std::vector<int> face = std::vector<int>(64, 0);
  WaveletImage image = forward_wavelet(8, 8, mask.data(), z.data());
  std::vector<CodedPatch> patches;
  TwoPatches() {
    CodedPatch patch = {};
    patch.header.width = patch.header.height = 8;
    patch.mask = mask.data(), patch.image = &image, patch.z = z.data(), patch.face = face.data();
    patches = {patch, patch};
  }
};

size_t pixels_in(const CodedPatch& p) { return size_t(std::count(p.mask, p.mask + 64, 1)); }

TEST(MaskEdits, TakeOutAndPutBack) {
  const TwoPatches two;
  std::list<CleanedPatch> storage;
  MaskEdits edits(two.patches, storage);
  EXPECT_FALSE(edits.apply());  // nothing to do
  edits.take_out({1, 7});
  edits.take_out({1, 63});
  ASSERT_TRUE(edits.apply());
  EXPECT_EQ(edits.patches()[0].mask, two.patches[0].mask);  // untouched
  EXPECT_EQ(pixels_in(edits.patches()[1]), 62u);
  EXPECT_EQ(edits.patches()[1].mask[7], 0);
  EXPECT_EQ(edits.patches()[1].image->mask.size(), two.image.mask.size());
  edits.put_back({1, 7});
  EXPECT_TRUE(edits.is_held({1, 7}));
  EXPECT_FALSE(edits.is_held({1, 63}));
  ASSERT_TRUE(edits.apply());
  EXPECT_EQ(pixels_in(edits.patches()[1]), 63u);
  edits.put_back({1, 63});
  ASSERT_TRUE(edits.apply());
  EXPECT_EQ(edits.patches()[1].image, two.patches[1].image);  // as it was
  EXPECT_FALSE(edits.apply());
}

TEST(MaskEdits, PatchesWithoutPixelsAreGone) {
  const TwoPatches two;
  std::list<CleanedPatch> storage;
  MaskEdits edits(two.patches, storage);
  for (uint32_t i = 0; i < 64; i++)
    if (i != 20) edits.take_out({0, i});  // one pixel alone is in no triangle
  ASSERT_TRUE(edits.apply());
  EXPECT_EQ(edits.patches().size(), 1u);
  EXPECT_EQ(edits.number(), (std::vector<int>{-1, 0}));
  const Pixel whole = edits.whole_pixel({0, 5});
  EXPECT_EQ(whole.patch, 1u);
  EXPECT_EQ(whole.index, 5u);
  for (uint32_t i = 0; i < 64; i++) edits.take_out({1, i});
  EXPECT_FALSE(edits.apply());  // nothing would be left
  EXPECT_EQ(edits.patches().size(), 1u);
}

}  // namespace
}  // namespace relief
