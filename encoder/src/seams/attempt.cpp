#include "seams/attempt.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief {
namespace {

// A face along the surface's border is a hole where its triangles' middles leave the surface by so many grid
// spacings.
constexpr float kHole = 1.0f;

double mismatch(const Topology& is, const Topology& should) {
  auto difference = [](double a, double b) { return std::abs(a - b); };
  return 3 * difference(double(is.components), double(should.components)) +
         2 * difference(double(is.boundary_loops), double(should.boundary_loops)) +
         difference(double(is.genus), double(should.genus));
}

// All that find_seams compares. Every vertex is used, and the decoder makes nothing but manifolds.
Topology topology_of(const SeamContext& in, const DecodedMesh& d) {
  const Borders::Count border = in.closed() ? Borders::Count{} : in.borders.count(d);
  const uint64_t faces = d.mesh.triangles.size(), edges = (3 * faces + border.edges) / 2;
  Topology t;
  t.components = uint64_t(join_across_gaps(d, in.part, in.parts, nullptr));
  t.boundary_loops = border.loops;
  t.euler = int64_t(d.mesh.positions.size()) - int64_t(edges) + int64_t(faces);
  t.genus = (2 * int64_t(t.components) - t.euler - int64_t(t.boundary_loops)) / 2;
  return t;
}

}  // namespace

SeamContext::SeamContext(const StreamParts& p, PatchDecoder d, const std::vector<CodedPatch>& patches,
                         const SeamsInput& in)
    : SeamsInput(in),
      coded(p),
      ground(ground_of(in.surface, patches, p.placement.spacing)),
      decoder(std::move(d)) {
  auto close = [&] {
    plain = decoder.close({});
    borders = Borders(plain);
  };
  auto connect = [&] {
    part = connected_parts(decoder.mesh(), decoder.open().mesh.triangle_count, parts);
    part.resize(ground.pixel.size());
  };
  tbb::parallel_invoke(close, connect);
}

PatchDecoder decoded_patches(const StreamParts& parts) {
  return PatchDecoder(assemble(parts, {parts.boundary_nodes, 0, 0}, {}));
}

Attempt attempt(const SeamContext& in, Seams seams) {
  Attempt a;
  std::sort(seams.dropped_links.begin(), seams.dropped_links.end());
  std::sort(seams.holes.begin(), seams.holes.end());
  a.decoded = in.decoder.close(seams, std::exchange(in.spare, {}));
  a.topology = topology_of(in, a.decoded);
  a.mismatch = mismatch(a.topology, in.topology);
  a.seams = std::move(seams);
  return a;
}

GapError error_of(const SeamContext& in, const Attempt& a, const GapError& like) {
  return gap_error(a.decoded, in.ground, in.distance, in.coded.placement.spacing, like, in.known.triangles);
}

std::vector<HoleFace> hole_faces(const SeamContext& in, const Attempt& filled) {
  return faces_along_border(filled.decoded, in.ground, in.border, error_of(in, filled),
                            in.coded.placement.spacing);
}

Attempt open_holes(const SeamContext& in, Seams links) {
  std::sort(links.handles.begin(), links.handles.end());
  Attempt filled = attempt(in, std::move(links));
  if (in.closed()) return filled;
  Seams seams = filled.seams;
  for (const HoleFace& hole : hole_faces(in, filled))
    if (hole.distance > kHole) seams.holes.push_back(hole.face);
  return seams.holes.empty() ? filled : attempt(in, std::move(seams));
}

Attempt with_links(const SeamContext& in, std::vector<uint32_t> dropped, const Pieces& pieces) {
  return open_holes(in, {std::move(dropped),
                         {},
                         missing_links(in.plain, in.decoder.open().nodes, in.ground, pieces),
                         {},
                         {},
                         {}});
}

Pieces pieces_of(const SeamContext& in, const std::vector<uint32_t>& dropped) {
  return join_parts(in.plain, in.ground, in.part, in.parts, dropped);
}

}  // namespace relief
