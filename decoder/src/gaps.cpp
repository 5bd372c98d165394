// Gap closing in linear time by links and faces.
//
// Every node (border vertex) looks for the nearest node that faces it (gap_partners); the pairs are links.
// Links and borders cut the space between the patches into faces (gap_links); each face is closed by
// triangles (gap_faces, triangulation). Handles too small for that are tubes (tube);
// where the surface bulges in between, triangles are split (steiner_points). All decisions are made with integers.
#include "gaps.h"

#include "gap_state.h"

namespace relief {
namespace {

void allocate(Gaps& g, Arena& a, uint32_t n) {
  uint32_t buckets = 1;
  while (buckets < n) buckets *= 2;
  g.bucket_mask = buckets - 1;
  g.link_capacity = 2 * n;
  g.corner_capacity = n + 2 * g.link_capacity;
  g.diagonal_capacity = 2 * g.corner_capacity;
  g.distance = a.take<int32_t>(n);
  g.slot_begin = a.take<uint32_t>(uint64_t(n) + 1);
  g.diagonals = a.take<uint32_t>(n);
  g.mark = a.take<uint32_t>(n);
  g.next = a.take<uint32_t>(n);
  g.open_corner = a.take<uint8_t>(n);
  g.cell_begin = a.take<uint32_t>(uint64_t(buckets) + 2);
  g.cell_nodes = a.take<CellNode>(n);
  g.group = a.take<uint32_t>(n);
  g.links = a.take<Link>(g.link_capacity);
  g.by_rank = a.take<uint32_t>(g.link_capacity);
  g.slots = a.take<Slot>(uint64_t(g.link_capacity) * 2);
  g.corner = a.take<Corner>(g.corner_capacity);
  g.diagonal = a.take<Diagonal>(g.diagonal_capacity);
  g.face = a.take<uint32_t>(g.corner_capacity);
}

}  // namespace

uint64_t gap_memory_bytes(uint32_t n) {
  Arena a(nullptr);
  const Nodes none = {};
  MeshWriter mesh = {};
  const GapOptions options = {};
  Gaps g(none, options, mesh);
  allocate(g, a, n);
  return a.used;
}

relief_status close_gaps(const Nodes& nodes, uint32_t components, const GapOptions& options, MeshWriter& mesh,
                         void* memory) {
  Gaps g(nodes, options, mesh);
  g.count = nodes.count;
  g.components = components;
  if (g.count == 0) return RELIEF_OK;
  Arena arena(memory);
  allocate(g, arena, nodes.count);
  g.work = 64 * int64_t(g.corner_capacity);
  if (!(kTracing && options.trace && options.trace->partners_known)) find_partners(g);
  if (!make_links(g)) return RELIEF_ERROR_CORRUPT;
  const uint32_t patch_triangles = mesh.triangle_count;
  relief_status status = close_faces(g);
  if (status != RELIEF_OK || !options.seams) return status;
  const uint32_t end = mesh.triangle_count;
  status = add_tubes(g, patch_triangles);
  return status == RELIEF_OK ? add_steiner_points(g, patch_triangles, end) : status;
}

}  // namespace relief
