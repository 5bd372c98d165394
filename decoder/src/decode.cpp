// From a stream to a mesh: relief_inspect and relief_decode.
#include "decode.h"

#include <string.h>

#include "coarse_mask.h"
#include "mesh.h"
#include "normals.h"
#include "output.h"
#include "planes.h"
#include "smooth.h"
#include "stage.h"
#include "wavelet.h"

namespace relief {
namespace {

// relief_options with its defaults filled in.
relief_options filled_in(const relief_options* given) {
  relief_options o = {};
  if (given) o = *given;
  const bool quantised = o.flags & RELIEF_QUANTISED;
  if (!o.limits) o.limits = &relief_default_limits;
  if (!o.position_stride) o.position_stride = quantised ? sizeof(int16_t[4]) : sizeof(float[3]);
  if (!o.normal_stride) o.normal_stride = quantised ? sizeof(int8_t[4]) : sizeof(float[3]);
  return o;
}

bool in_range(const relief_options& o) {
  constexpr uint32_t kForms = RELIEF_SMOOTH | RELIEF_QUANTISED | RELIEF_INDICES_16;
  constexpr uint32_t kFlags = RELIEF_POINTS | (kPlain ? 0 : kForms);
  if (o.level > RELIEF_MAX_LEVEL || o.flags & ~kFlags) return false;
  if (kPlain) return true;
  if (o.flags & RELIEF_SMOOTH && o.flags & RELIEF_POINTS) return false;
  const relief_options least = filled_in(nullptr);
  const bool quantised = o.flags & RELIEF_QUANTISED;
  return o.position_stride % 4 == 0 && o.position_stride >= (quantised ? 8 : least.position_stride) &&
         o.normal_stride % 4 == 0 && o.normal_stride >= (quantised ? 4 : least.normal_stride);
}

struct Workspace {
  PatchHeader* patches;
  Planes planes;
  float* scratch;
  MeshScratch mesh;
  Nodes nodes;
  uint8_t* gaps;
  // what is not made in the caller's memory, else null
  float *positions, *normals;
  uint32_t* indices;  // of points: of the patch at hand
};

// The most that a decode may write.
struct Capacity {
  uint64_t vertices, triangles;
};

Capacity with_gaps(uint64_t pixels, const StreamHeader& h) {
  return {pixels + gap_vertices(h.boundary_nodes), 2 * pixels + gap_triangles(h.boundary_nodes)};
}

Capacity capacity_of(const relief_options& o, const Parsed& parsed) {
  const StreamHeader& h = parsed.header;
  const uint64_t low = parsed.totals.low_pixels, pixels = low < h.mask_pixels ? low : h.mask_pixels;
  return o.flags & RELIEF_POINTS ? Capacity{pixels, 0} : with_gaps(pixels, h);
}

// Lays the workspace out; with an empty arena it only counts. Returns the bytes used.
uint64_t lay_out(Arena& a, const relief_options& o, const Parsed& parsed, Workspace& w) {
  const Totals& t = parsed.totals;
  const uint32_t patches = parsed.header.patch_count, nodes = parsed.header.boundary_nodes;
  w.patches = a.take<PatchHeader>(patches);
  Planes& p = w.planes;
  p.patches = w.patches;
  p.patch_count = patches;
  p.level = parsed.level;
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
  const bool points = o.flags & RELIEF_POINTS;
  const Capacity most = capacity_of(o, parsed);
  w.gaps = points ? nullptr : a.take<uint8_t>(gap_memory_bytes(nodes));
  w.positions = float_positions(o) ? nullptr : a.take<float>(3 * most.vertices);
  w.normals = float_normals(o) ? nullptr : a.take<float>(3 * most.vertices);
  w.indices = points            ? a.take<uint32_t>(6 * t.max_pixels)
              : wide_indices(o) ? nullptr
                                : a.take<uint32_t>(3 * most.triangles);
  return a.used + 16;
}

relief_status parse(const void* data, size_t size, const relief_options& o, Parsed& parsed) {
  if (!data || !in_range(o)) return RELIEF_ERROR_ARGUMENT;
  const relief_status status = parse_header(data, size, *o.limits, parsed);
  if (status != RELIEF_OK) return status;
  parsed.level = int(o.level);
  RangeDecoder coder(static_cast<const uint8_t*>(data) + parsed.table_begin, parsed.header.table_bytes,
                     false);
  return parse_table(coder, *o.limits, parsed, nullptr);
}

// One patch, from coefficients to triangles. Of a coarser level it may have more border than there is room
// for, if the stream is hostile or odd; then it is left out.
relief_status add_patch(uint32_t i, Workspace& w, OpenPatches& open, const Leaves& leaves) {
  const StreamHeader& h = open.parsed.header;
  const int level = open.parsed.level;
  const PatchHeader& patch = w.patches[i];
  const Pyramid p = pyramid_of(patch.width, patch.height);
  const float step = float(double(h.step) * quarter_power(patch.step_index));
  uint8_t* const mask = w.planes.mask + w.planes.begin[i];
  const float* z = inverse_wavelet(p, w.planes.q + w.planes.begin[i], mask, step, w.scratch, leaves, level);
  const Band& low = p.low[level];
  if (level > 0) tidy_mask(mask + low.at(0, 0), low.width, low.height, low.stride, w.mesh.node);
  stage_done(Stage::kWavelet);
  const MeshWriter before = open.mesh;
  const uint32_t nodes = w.nodes.count, components = open.components;
  const relief_status status = mesh_patch(patch, i, spacing_of(h.spacing, patch), p, level, mask, z, w.mesh,
                                          open.mesh, w.nodes, open.components, leaves);
  stage_done(Stage::kMesh);
  if (level == 0 || status != RELIEF_ERROR_CORRUPT) return status;
  open.mesh = before;
  w.nodes.count = nodes, open.components = components;
  return RELIEF_OK;
}

// normals: of points, which have them of their own patch's triangles; may be null
relief_status mesh_patches(const relief_options& o, Workspace& w, OpenPatches& open, float* normals,
                           const Leaves& leaves) {
  const StreamHeader& h = open.parsed.header;
  open.components = 0;
  open.whole = true;
  for (uint32_t i = 0; i < h.patch_count; i++) {
    if (o.patches && !o.patches[i]) {
      open.whole = false;
      continue;
    }
    const uint32_t first = open.mesh.vertex_count;
    const relief_status status = add_patch(i, w, open, leaves);
    if (status != RELIEF_OK) return status;
    if (!(o.flags & RELIEF_POINTS)) continue;
    if (normals) {
      memset(normals + 3 * size_t(first), 0, sizeof(float[3]) * (open.mesh.vertex_count - first));
      add_normals(open.mesh, normals);
    }
    open.mesh.triangle_count = 0;
  }
  if (open.parsed.level > 0 || !open.whole) return RELIEF_OK;
  return w.nodes.count == h.boundary_nodes ? RELIEF_OK : RELIEF_ERROR_CORRUPT;
}

// Everything before the gaps, but for what begin has filled in.
relief_status open_patches(const uint8_t* data, const relief_options& o, Workspace& w, OpenPatches& open,
                           float* normals, const Leaves& leaves) {
  Parsed& parsed = open.parsed;
  const StreamHeader& h = parsed.header;
  RangeDecoder table(data + parsed.table_begin, h.table_bytes, false);
  relief_status status = parse_table(table, *o.limits, parsed, w.patches);
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

  status = mesh_patches(o, w, open, normals, leaves);
  if (status != RELIEF_OK) return status;
  float largest = 0;
  for (uint32_t i = 0; i < h.patch_count; i++) {
    const float s = spacing_of(h.spacing, w.patches[i]);
    if (s > largest) largest = s;
  }
  open.spacing = int32_t(largest * float(1 << parsed.level));
  open.nodes = w.nodes;
  open.gap_memory = w.gaps;
  return RELIEF_OK;
}

// Checks the arguments and lays the workspace out.
relief_status begin(const void* data, size_t size, const relief_options& o, const relief_mesh* mesh,
                    void* workspace, size_t workspace_size, Workspace& w, OpenPatches& open) {
  const bool points = o.flags & RELIEF_POINTS;
  if (!mesh || !mesh->positions || (!mesh->indices && !points) || !workspace) return RELIEF_ERROR_ARGUMENT;
  if (reinterpret_cast<uintptr_t>(workspace) & 15) return RELIEF_ERROR_ARGUMENT;
  const relief_status status = parse(data, size, o, open.parsed);
  if (status != RELIEF_OK) return status;
  Arena counted(nullptr), arena(workspace);
  if (lay_out(counted, o, open.parsed, w) > workspace_size) return RELIEF_ERROR_WORKSPACE;
  lay_out(arena, o, open.parsed, w);
  auto least = [](uint32_t a, uint64_t b) { return b < a ? uint32_t(b) : a; };
  const Capacity most = capacity_of(o, open.parsed);
  open.mesh = {w.positions ? w.positions : static_cast<float*>(mesh->positions),
               w.indices ? w.indices : static_cast<uint32_t*>(mesh->indices),
               least(mesh->vertex_capacity, most.vertices),
               points ? least(UINT32_MAX, 2 * open.parsed.totals.max_pixels)
                      : least(mesh->triangle_capacity, most.triangles),
               0,
               0};
  return RELIEF_OK;
}

relief_status decode(const void* data, size_t size, const relief_options& o, relief_mesh* out,
                     void* workspace, size_t workspace_size, const Leaves& leaves) {
  Workspace w;
  OpenPatches open;
  relief_status status = begin(data, size, o, out, workspace, workspace_size, w, open);
  if (status != RELIEF_OK) return status;
  const uint8_t* const bytes = static_cast<const uint8_t*>(data);
  float* const normals = !out->normals ? nullptr : w.normals ? w.normals : static_cast<float*>(out->normals);
  status = open_patches(bytes, o, w, open, normals, leaves);
  if (status != RELIEF_OK) return status;
  MeshWriter& mesh = open.mesh;
  if (!(o.flags & RELIEF_POINTS)) {
    const uint32_t patch_vertices = mesh.vertex_count;
    // the seams are those of the whole mesh at level 0; without all patches no surface is closed
    const uint8_t* const seams = open.whole && o.level == 0 ? seams_of(open.parsed, bytes) : nullptr;
    const bool closed = open.whole && open.parsed.header.flags & kFlagClosed;
    status = close_gaps(open.nodes, open.components, {open.spacing, closed, seams, bytes + size, nullptr},
                        mesh, open.gap_memory);
    if (status != RELIEF_OK) return status;
    stage_done(Stage::kGaps);
    if (!kPlain && o.flags & RELIEF_SMOOTH)  // in memory that is free again: planes have an element a pixel
                                             // and more, gap closing takes more a node
      smooth_nodes(open.nodes, patch_vertices, mesh, reinterpret_cast<uint32_t*>(w.planes.q),
                   reinterpret_cast<int64_t(*)[4]>(w.gaps));
    if (normals) {
      memset(normals, 0, sizeof(float[3]) * mesh.vertex_count);
      add_normals(mesh, normals);
    }
  }
  if (normals) leaves.normalise(normals, mesh.vertex_count);
  stage_done(Stage::kNormals);
  status = write_output(o, open.parsed.header, mesh, normals, *out, leaves);
  stage_done(Stage::kPlacement);
  return status;
}

}  // namespace

void place(const StreamHeader& h, float* positions, uint32_t count) {
  best_leaves().place(h.origin, h.scale, positions, count);
}

const uint8_t* seams_of(const Parsed& parsed, const uint8_t* data) {
  return parsed.cut ? nullptr : data + parsed.coefficients_begin + parsed.coefficient_bytes;
}

relief_status decode_with(const Leaves& leaves, const void* data, size_t size, const relief_options* options,
                          relief_mesh* mesh, void* workspace, size_t workspace_size) {
  return decode(data, size, filled_in(options), mesh, workspace, workspace_size, leaves);
}

relief_status decode_patches(const void* data, size_t size, const relief_options* options, relief_mesh* mesh,
                             void* workspace, size_t workspace_size, OpenPatches& open) {
  Workspace w;
  const relief_options o = filled_in(options);
  const relief_status status = begin(data, size, o, mesh, workspace, workspace_size, w, open);
  return status == RELIEF_OK
             ? open_patches(static_cast<const uint8_t*>(data), o, w, open, nullptr, best_leaves())
             : status;
}

}  // namespace relief

using namespace relief;

extern "C" relief_status relief_inspect(const void* data, size_t size, const relief_options* options,
                                        relief_info* info) {
  if (!info) return RELIEF_ERROR_ARGUMENT;
  const relief_options o = filled_in(options);
  Parsed parsed;
  const relief_status status = parse(data, size, o, parsed);
  if (status != RELIEF_OK) return status;
  const StreamHeader& h = parsed.header;
  const Capacity all = with_gaps(h.mask_pixels, h), most = capacity_of(o, parsed);
  if (all.vertices > UINT32_MAX || all.triangles > UINT32_MAX || h.vertex_count > o.limits->max_vertices ||
      memory_bound(parsed) > memory_allowed(*o.limits, size))
    return RELIEF_ERROR_LIMIT;
  if (h.vertex_count > all.vertices || h.triangle_count > all.triangles) return RELIEF_ERROR_CORRUPT;
  Arena counted(nullptr);
  Workspace w;
  relief_info r = {};
  r.workspace_bytes = lay_out(counted, o, parsed, w);
  r.version = RELIEF_STREAM_VERSION;
  r.patch_count = h.patch_count;
  r.pixel_count = uint32_t(parsed.totals.pixels);
  r.vertex_count = h.vertex_count;
  r.triangle_count = h.triangle_count;
  r.vertex_capacity = uint32_t(most.vertices);
  r.triangle_capacity = uint32_t(most.triangles);
  for (int i = 0; i < 3; i++) r.origin[i] = h.origin[i];
  r.scale = h.scale;
  r.masks_end = uint32_t(parsed.coefficients_begin);
  *info = r;
  return RELIEF_OK;
}

extern "C" relief_status relief_decode(const void* data, size_t size, const relief_options* options,
                                       relief_mesh* mesh, void* workspace, size_t workspace_size) {
  return decode(data, size, filled_in(options), mesh, workspace, workspace_size, best_leaves());
}
