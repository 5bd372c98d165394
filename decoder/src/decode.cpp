// From a stream to a mesh: relief_inspect and relief_decode.
#include "decode.h"

#include <string.h>

#include "mesh.h"
#include "normals.h"
#include "planes.h"
#include "smooth.h"
#include "stage.h"
#include "wavelet.h"

namespace relief {
namespace {

struct Workspace {
  PatchHeader* patches;
  Planes planes;
  float* scratch;
  MeshScratch mesh;
  Nodes nodes;
  uint8_t* gaps;
};

// Lays the workspace out; with an empty arena it only counts. Returns the bytes used.
uint64_t lay_out(Arena& a, const Parsed& parsed, Workspace& w) {
  const Totals& t = parsed.totals;
  const uint32_t patches = parsed.header.patch_count, nodes = parsed.header.boundary_nodes;
  w.patches = a.take<PatchHeader>(patches);
  Planes& p = w.planes;
  p.patches = w.patches;
  p.patch_count = patches;
  p.begin = a.take<uint64_t>(patches);
  p.mask_models = a.take<MaskModels>(1);
  const bool bisk = parsed.header.flags & kFlagBisk;
  p.coefficient_models = bisk ? nullptr : a.take<CoefficientModels>(1);
  p.bisk_state = bisk ? a.take<BiskState>(1) : nullptr;
  p.bisk_patches = bisk ? a.take<BiskPatch>(patches) : nullptr;
  p.bisk_sets = bisk ? a.take<BiskSet>(parsed.header.mask_pixels) : nullptr;
  p.mask_buffer = a.take<uint8_t>(t.max_mask);
  p.q = a.take<int32_t>(t.planes);
  p.mask = a.take<uint8_t>(t.planes);
  w.scratch = a.take<float>(t.scratch);
  p.mask_scratch = a.take<uint8_t>(2 * t.max_pixels + 8 * uint64_t(t.max_width) + 64);
  w.mesh.cells = p.mask_scratch;  // between two uses of the one there is one of the other
  w.mesh.height = a.take<int32_t>(t.max_pixels);
  w.mesh.vertex = a.take<uint32_t>(t.max_pixels);
  w.mesh.node = a.take<uint32_t>(t.max_pixels);
  w.mesh.run = a.take<uint32_t>(t.max_pixels);
  w.mesh.run_of_cell = a.take<uint32_t>(t.max_pixels);
  w.nodes.allocate(a, nodes);
  w.gaps = a.take<uint8_t>(gap_memory_bytes(nodes));
  return a.used + 16;
}

relief_status parse(const void* data, size_t size, const relief_limits* limits, Parsed& parsed) {
  if (!data) return RELIEF_ERROR_ARGUMENT;
  const relief_limits& l = limits ? *limits : relief_default_limits;
  const relief_status status = parse_header(data, size, l, parsed);
  if (status != RELIEF_OK) return status;
  RangeDecoder coder(static_cast<const uint8_t*>(data) + parsed.table_begin, parsed.header.table_bytes,
                     false);
  return parse_table(coder, l, parsed, nullptr);
}

relief_status mesh_patches(const Parsed& parsed, Workspace& w, MeshWriter& mesh, uint32_t& components,
                           const Leaves& leaves) {
  components = 0;
  for (uint32_t i = 0; i < parsed.header.patch_count; i++) {
    const PatchHeader& patch = w.patches[i];
    const Pyramid p = pyramid_of(patch.width, patch.height);
    const float step = float(double(parsed.header.step) * quarter_power(patch.step_index));
    const uint64_t begin = w.planes.begin[i];
    const uint8_t* const mask = w.planes.mask + begin;
    const float* z = inverse_wavelet(p, w.planes.q + begin, mask, step, w.scratch, leaves);
    stage_done(Stage::kWavelet);
    const relief_status status = mesh_patch(patch, i, spacing_of(parsed.header.spacing, patch), p, mask, z,
                                            w.mesh, mesh, w.nodes, components, leaves);
    if (status != RELIEF_OK) return status;
    stage_done(Stage::kMesh);
  }
  return w.nodes.count == parsed.header.boundary_nodes ? RELIEF_OK : RELIEF_ERROR_CORRUPT;
}

// Everything before the gaps, but for what begin has filled in.
relief_status open_patches(const uint8_t* data, const relief_limits* limits, Workspace& w, OpenPatches& open,
                           const Leaves& leaves) {
  Parsed& parsed = open.parsed;
  const StreamHeader& h = parsed.header;
  RangeDecoder table(data + parsed.table_begin, h.table_bytes, false);
  relief_status status = parse_table(table, limits ? *limits : relief_default_limits, parsed, w.patches);
  if (status != RELIEF_OK) return status;
  memset(w.planes.q, 0, parsed.totals.planes * sizeof(*w.planes.q));
  memset(w.planes.mask, 0, parsed.totals.planes);
  uint64_t offset = 0;
  for (uint32_t i = 0; i < h.patch_count; i++) {
    w.planes.begin[i] = offset;
    offset += pyramid_of(w.patches[i].width, w.patches[i].height).size;
  }
  stage_done(Stage::kTable);
  if (decode_masks(table, w.planes, leaves) != h.mask_pixels) return RELIEF_ERROR_CORRUPT;
  stage_done(Stage::kMasks);

  const uint8_t* const coefficients = data + parsed.coefficients_begin;
  RangeDecoder coder(coefficients, parsed.coefficient_bytes, parsed.coefficient_bytes < h.coefficient_bytes);
  decode_coefficients(coder, w.planes, leaves);
  stage_done(Stage::kCoefficients);

  open.components = 0;
  status = mesh_patches(parsed, w, open.mesh, open.components, leaves);
  if (status != RELIEF_OK) return status;
  float largest = 0;
  for (uint32_t i = 0; i < h.patch_count; i++) {
    const float s = spacing_of(h.spacing, w.patches[i]);
    if (s > largest) largest = s;
  }
  open.spacing = int32_t(largest);
  open.nodes = w.nodes;
  open.gap_memory = w.gaps;
  return RELIEF_OK;
}

// Checks the arguments and lays the workspace out.
relief_status begin(const void* data, size_t size, const relief_limits* limits, const relief_mesh* mesh,
                    void* workspace, size_t workspace_size, Workspace& w, OpenPatches& open) {
  if (!mesh || !mesh->positions || !mesh->indices || !workspace) return RELIEF_ERROR_ARGUMENT;
  if (reinterpret_cast<uintptr_t>(workspace) & 15) return RELIEF_ERROR_ARGUMENT;
  const relief_status status = parse(data, size, limits, open.parsed);
  if (status != RELIEF_OK) return status;
  Arena counted(nullptr), arena(workspace);
  if (lay_out(counted, open.parsed, w) > workspace_size) return RELIEF_ERROR_WORKSPACE;
  lay_out(arena, open.parsed, w);
  open.mesh = {mesh->positions, mesh->indices, mesh->vertex_capacity, mesh->triangle_capacity, 0, 0};
  return RELIEF_OK;
}

// Null for none: builds that have no use for smoothing leave the function away.
using Smoothing = decltype(smooth_nodes);

relief_status decode(const void* data, size_t size, const relief_limits* limits, relief_mesh* out,
                     void* workspace, size_t workspace_size, Smoothing* smooth, const Leaves& leaves) {
  Workspace w;
  OpenPatches open;
  relief_status status = begin(data, size, limits, out, workspace, workspace_size, w, open);
  if (status != RELIEF_OK) return status;
  const uint8_t* const bytes = static_cast<const uint8_t*>(data);
  status = open_patches(bytes, limits, w, open, leaves);
  if (status != RELIEF_OK) return status;
  const StreamHeader& h = open.parsed.header;
  MeshWriter& mesh = open.mesh;
  const GapOptions options = {open.spacing, (h.flags & kFlagClosed) != 0, seams_of(open.parsed, bytes),
                              bytes + size, nullptr};
  status = close_gaps(open.nodes, open.components, options, mesh, open.gap_memory);
  if (status != RELIEF_OK) return status;
  stage_done(Stage::kGaps);
  if (smooth)  // in memory that is free again: planes have an element a pixel and more, gap closing takes
               // more a node
    smooth(open.nodes, h.mask_pixels, mesh, reinterpret_cast<uint32_t*>(w.planes.q),
           reinterpret_cast<int64_t(*)[4]>(w.gaps));
  if (out->normals) vertex_normals(mesh, out->normals, leaves);
  stage_done(Stage::kNormals);
  leaves.place(h.origin, h.scale, mesh.positions, mesh.vertex_count);
  stage_done(Stage::kPlacement);
  out->vertex_count = mesh.vertex_count;
  out->triangle_count = mesh.triangle_count;
  return RELIEF_OK;
}

}  // namespace

void place(const StreamHeader& h, float* positions, uint32_t count) {
  best_leaves().place(h.origin, h.scale, positions, count);
}

const uint8_t* seams_of(const Parsed& parsed, const uint8_t* data) {
  return parsed.cut ? nullptr : data + parsed.coefficients_begin + parsed.coefficient_bytes;
}

relief_status decode_with(const Leaves& leaves, bool smooth, const void* data, size_t size,
                          const relief_limits* limits, relief_mesh* mesh, void* workspace,
                          size_t workspace_size) {
  return decode(data, size, limits, mesh, workspace, workspace_size, smooth ? smooth_nodes : nullptr, leaves);
}

relief_status decode_patches(const void* data, size_t size, const relief_limits* limits, relief_mesh* mesh,
                             void* workspace, size_t workspace_size, OpenPatches& open) {
  Workspace w;
  const relief_status status = begin(data, size, limits, mesh, workspace, workspace_size, w, open);
  return status == RELIEF_OK ? open_patches(static_cast<const uint8_t*>(data), limits, w, open, best_leaves())
                             : status;
}

}  // namespace relief

using namespace relief;

extern "C" relief_status relief_inspect(const void* data, size_t size, const relief_limits* limits,
                                        relief_info* info) {
  if (!info) return RELIEF_ERROR_ARGUMENT;
  Parsed parsed;
  const relief_status status = parse(data, size, limits, parsed);
  if (status != RELIEF_OK) return status;
  const StreamHeader& h = parsed.header;
  const relief_limits& l = limits ? *limits : relief_default_limits;
  const uint64_t vertices = h.mask_pixels + gap_vertices(h.boundary_nodes);
  const uint64_t triangles = 2 * uint64_t(h.mask_pixels) + gap_triangles(h.boundary_nodes);
  if (vertices > 0xffffffffu || triangles > 0xffffffffu || h.vertex_count > l.max_vertices)
    return RELIEF_ERROR_LIMIT;
  if (h.vertex_count > vertices || h.triangle_count > triangles) return RELIEF_ERROR_CORRUPT;
  Arena counted(nullptr);
  Workspace w;
  relief_info r = {};
  r.workspace_bytes = lay_out(counted, parsed, w);
  r.version = RELIEF_STREAM_VERSION;
  r.patch_count = h.patch_count;
  r.pixel_count = uint32_t(parsed.totals.pixels);
  r.vertex_count = h.vertex_count;
  r.triangle_count = h.triangle_count;
  r.vertex_capacity = uint32_t(vertices);
  r.triangle_capacity = uint32_t(triangles);
  for (int i = 0; i < 3; i++) r.origin[i] = h.origin[i];
  r.scale = h.scale;
  r.masks_end = uint32_t(parsed.coefficients_begin);
  *info = r;
  return RELIEF_OK;
}

extern "C" relief_status relief_decode(const void* data, size_t size, const relief_limits* limits,
                                       relief_mesh* mesh, void* workspace, size_t workspace_size) {
  return decode(data, size, limits, mesh, workspace, workspace_size, nullptr, best_leaves());
}

extern "C" relief_status relief_decode_smoothed(const void* data, size_t size, const relief_limits* limits,
                                                relief_mesh* mesh, void* workspace, size_t workspace_size) {
  return decode(data, size, limits, mesh, workspace, workspace_size, smooth_nodes, best_leaves());
}
