// From a stream to a mesh: relief_inspect and relief_decode.
#include "decode.h"

#include <string.h>

#include "coarse_mask.h"
#include "colours.h"
#include "mesh.h"
#include "normals.h"
#include "output.h"
#include "planes.h"
#include "restore.h"
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
  if (!o.color_stride) o.color_stride = sizeof(uint8_t[4]);
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
         o.normal_stride % 4 == 0 && o.normal_stride >= (quantised ? 4 : least.normal_stride) &&
         o.color_stride % 4 == 0;
}

// What a decode that goes on later has to find again: the same bytes up to the masks' end, the same options.
struct Progress {
  uint64_t check;
  uint32_t level, flags;
  bool operator==(const Progress& o) const {
    return check == o.check && level == o.level && flags == o.flags;
  }
};

struct Workspace {
  Progress* progress;  // first of all
  PatchHeader* patches;
  Planes planes;
  float* scratch;
  MeshScratch mesh;
  Nodes nodes;
  uint8_t* gaps;
  ColourPlanes colours;
  // what is not made in the caller's memory, else null
  float *positions, *normals;
  uint32_t* indices;  // of points: of the patch at hand
  uint32_t* smoothing;
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
  w.progress = a.take<Progress>(1);
  w.patches = a.take<PatchHeader>(patches);
  Planes& p = w.planes;
  p.patches = w.patches;
  p.patch_count = patches;
  p.level = parsed.level;
  p.begin = a.take<PlanesBegin>(patches);
  const bool bisk = parsed.header.flags & kFlagBisk;
  const bool coloured = parsed.header.flags & kFlagColoured;
  p.coefficient_models = bisk && !coloured ? nullptr : a.take<CoefficientModels>(1);
  p.subband_state = bisk ? nullptr : a.take<SubbandState>(1);
  p.bisk_state = bisk ? a.take<BiskState>(1) : nullptr;
  p.bisk_patches = bisk ? a.take<BiskPatch>(patches) : nullptr;
  p.bisk_sets = bisk ? a.take<BiskSet>(parsed.header.mask_pixels) : nullptr;
  w.nodes.allocate(a, nodes);
  const bool points = o.flags & RELIEF_POINTS;
  const Capacity most = capacity_of(o, parsed);
  w.positions = float_positions(o) ? nullptr : a.take<float>(3 * most.vertices);
  w.normals = float_normals(o) ? nullptr : a.take<float>(3 * most.vertices);
  w.indices = points            ? a.take<uint32_t>(6 * t.max_pixels)
              : wide_indices(o) ? nullptr
                                : a.take<uint32_t>(3 * most.triangles);
  w.smoothing = o.flags & RELIEF_SMOOTH ? a.take<uint32_t>(most.vertices) : nullptr;
  w.colours.state = coloured ? a.take<SubbandState>(1) : nullptr;
  for (int c = 0; c < kChannels && coloured; c++) w.colours.q[c] = a.take<int32_t>(t.coded);
  p.q = a.take<int32_t>(t.coded);
  p.mask = a.take<uint8_t>(t.planes);
  // last what is used for one patch after the other, and in its place, after all patches, what gaps take
  const uint64_t begin = a.used, end = begin + 16 + gap_memory_bytes(nodes);
  p.mask_models = a.take<MaskModels>(1);
  w.gaps = reinterpret_cast<uint8_t*>(p.mask_models);
  p.mask_buffer = a.take<uint8_t>(t.max_mask);
  w.scratch = a.take<float>(t.scratch);
  p.mask_scratch = a.take<uint8_t>(2 * t.max_pixels + 8 * uint64_t(t.max_width) + 64);
  w.mesh.cells = p.mask_scratch;  // between two uses of the one there is one of the other
  w.mesh.vertex = a.take<uint32_t>(t.max_pixels);
  w.mesh.run = a.take<Run>(t.max_pixels);
  w.mesh.first_run = a.take<uint32_t>(t.max_height);
  w.mesh.way = a.take<uint8_t>(t.max_pixels);
  for (int c = 0; c < kChannels && coloured; c++) w.colours.image[c] = a.take<int16_t>(t.max_pixels);
  return (a.used < end ? end : a.used) + 16;
}

relief_status parse(const void* data, size_t size, const relief_options& o, Parsed& parsed) {
  if (!data || !in_range(o)) return RELIEF_ERROR_ARGUMENT;
  const relief_status status = parse_header(data, size, *o.limits, parsed);
  if (status != RELIEF_OK) return status;
  parsed.level = int(o.level);
  RangeDecoder coder = table_coder(data, parsed);
  return parse_table(coder, *o.limits, parsed, nullptr);
}

// One patch, from coefficients to triangles. Of a coarser level it may have more border than there is room
// for, if the stream is hostile or odd; then it is left out.
relief_status add_patch(uint32_t i, Workspace& w, OpenPatches& open, uint8_t* colors, size_t color_stride,
                        const Leaves& leaves) {
  const StreamHeader& h = open.parsed.header;
  const int level = open.parsed.level;
  const PatchHeader& patch = w.patches[i];
  const Pyramid p = pyramid_of(patch.width, patch.height);
  const float step = float(double(h.step) * quarter_power(patch.step_index));
  uint8_t* const mask = w.planes.mask + w.planes.begin[i].mask;
  if (colors) make_colour_images(open.parsed, w.planes, i, w.colours, w.scratch, leaves);
  const float* z = inverse_wavelet(p, w.planes.q + w.planes.begin[i].q, mask, step, w.scratch, leaves, level);
  const Band& low = p.low[level];
  // where the wavelet had its halves, which with their masks take more
  float* const halves = w.scratch + wavelet_values(p.low[0].width, p.low[0].height);
  w.mesh.height = reinterpret_cast<int32_t*>(level > 0 ? halves : w.scratch);
  if (level > 0) {
    tidy_mask(mask + low.at(0, 0), low.width, low.height, low.stride, w.mesh.vertex);
  } else {
    restore(p, mask, z, step, halves, leaves);
    z = halves;
  }
  stage_done(Stage::kWavelet);
  const MeshWriter before = open.mesh;
  const uint32_t nodes = w.nodes.count, loops = w.nodes.loop_count, components = open.components;
  const relief_status status = mesh_patch(patch, i, spacing_of(h.spacing, patch), p, level, mask, z, w.mesh,
                                          open.mesh, w.nodes, open.components, leaves);
  if (status == RELIEF_OK && colors)
    write_patch_colours(w.colours, low, mask, colors + before.vertex_count * color_stride, color_stride);
  stage_done(Stage::kMesh);
  if (level == 0 || status != RELIEF_ERROR_CORRUPT) return status;
  open.mesh = before;
  w.nodes.count = nodes, w.nodes.loop_count = loops, open.components = components;
  return RELIEF_OK;
}

// normals: of points, which have them of their own patch's triangles; may be null
relief_status mesh_patches(const relief_options& o, Workspace& w, OpenPatches& open, float* normals,
                           uint8_t* colors, const Leaves& leaves) {
  const StreamHeader& h = open.parsed.header;
  open.components = 0;
  open.whole = !open.parsed.masks_cut();
  for (uint32_t i = 0; i < h.patch_count; i++) {
    if (o.patches && !o.patches[i]) {
      open.whole = false;
      continue;
    }
    const uint32_t first = open.mesh.vertex_count;
    const relief_status status = add_patch(i, w, open, colors, o.color_stride, leaves);
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

// Table and masks: what comes before the coefficients.
relief_status read_masks(const uint8_t* data, const relief_options& o, const Workspace& w, Parsed& parsed,
                         const Leaves& leaves) {
  const StreamHeader& h = parsed.header;
  RangeDecoder table = table_coder(data, parsed);
  const relief_status status = parse_table(table, *o.limits, parsed, w.patches);
  if (status != RELIEF_OK) return status;
  memset(w.planes.mask, 0, parsed.totals.planes);
  stage_done(Stage::kTable);
  const uint64_t pixels = decode_masks(table, w.planes, leaves);
  if (parsed.masks_cut() ? pixels > h.mask_pixels : pixels != h.mask_pixels) return RELIEF_ERROR_CORRUPT;
  stage_done(Stage::kMasks);
  return RELIEF_OK;
}

void start_coefficients(const Workspace& w, const Parsed& parsed) {
  memset(w.planes.q, 0, parsed.totals.coded * sizeof(*w.planes.q));
  start_coefficients(w.planes);
}

// Room for the coefficients in the caller's indices, memory that is touched anyway, or null: at the end of as
// many as the stream says that there are. Patches are meshed one after the other: none may write over the
// coefficients of a later one.
int32_t* room_in_indices(const relief_options& o, const Workspace& w, const Parsed& parsed,
                         const relief_mesh& mesh) {
  if (kPlain || o.level > 0 || o.flags & RELIEF_POINTS || w.indices) return nullptr;
  const uint64_t count = parsed.header.triangle_count, coded = parsed.totals.coded;
  const uint64_t all = 3 * (mesh.triangle_capacity < count ? mesh.triangle_capacity : count);
  if (all < coded) return nullptr;
  for (uint32_t i = 1; i < w.planes.patch_count; i++)
    if (6 * w.planes.begin[i].pixels > all - coded + w.planes.begin[i].q) return nullptr;
  return static_cast<int32_t*>(mesh.indices) + (all - coded);
}

void read_coefficients(const uint8_t* data, const Workspace& w, const Parsed& parsed, const Leaves& leaves) {
  continue_coefficients(data + parsed.coefficients_begin, parsed.coefficient_bytes,
                        parsed.coefficient_bytes < parsed.header.coefficient_bytes, w.planes, leaves);
  stage_done(Stage::kCoefficients);
}

// Everything of the mesh before the gaps, but for what begin has filled in.
relief_status open_patches(const relief_options& o, Workspace& w, OpenPatches& open, float* normals,
                           uint8_t* colors, const Leaves& leaves) {
  const StreamHeader& h = open.parsed.header;
  const relief_status status = mesh_patches(o, w, open, normals, colors, leaves);
  if (status != RELIEF_OK) return status;
  float largest = 0;
  for (uint32_t i = 0; i < h.patch_count; i++) {
    const float s = spacing_of(h.spacing, w.patches[i]);
    if (s > largest) largest = s;
  }
  open.spacing = int32_t(largest * float(1 << open.parsed.level));
  open.nodes = w.nodes;
  open.patches = w.patches;
  open.begin = w.planes.begin, open.mask = w.planes.mask;
  open.gap_memory = w.gaps;
  return RELIEF_OK;
}

// Whether a mesh can be written there.
bool is_writable(const relief_options& o, const relief_mesh* mesh) {
  return mesh && mesh->positions && (mesh->indices || o.flags & RELIEF_POINTS);
}

// Checks the arguments but for the mesh, and lays the workspace out.
relief_status begin(const void* data, size_t size, const relief_options& o, void* workspace,
                    size_t workspace_size, Workspace& w, Parsed& parsed) {
  if (!workspace || reinterpret_cast<uintptr_t>(workspace) & 15) return RELIEF_ERROR_ARGUMENT;
  const relief_status status = parse(data, size, o, parsed);
  if (status != RELIEF_OK) return status;
  Arena counted(nullptr), arena(workspace);
  if (lay_out(counted, o, parsed, w) > workspace_size) return RELIEF_ERROR_WORKSPACE;
  lay_out(arena, o, parsed, w);
  return RELIEF_OK;
}

MeshWriter writer_for(const relief_options& o, const Workspace& w, const Parsed& parsed,
                      const relief_mesh& mesh) {
  auto least = [](uint32_t a, uint64_t b) { return b < a ? uint32_t(b) : a; };
  const Capacity most = capacity_of(o, parsed);
  return {w.positions ? w.positions : static_cast<float*>(mesh.positions),
          w.indices ? w.indices : static_cast<uint32_t*>(mesh.indices),
          least(mesh.vertex_capacity, most.vertices),
          o.flags & RELIEF_POINTS ? least(UINT32_MAX, 2 * parsed.totals.max_pixels)
                                  : least(mesh.triangle_capacity, most.triangles),
          0,
          0};
}

// From the planes to the mesh. Leaves what is needed to go on alone, but for masks at coarser levels.
relief_status make_mesh(const uint8_t* data, const relief_options& o, Workspace& w, OpenPatches& open,
                        relief_mesh* out, const Leaves& leaves) {
  open.mesh = writer_for(o, w, open.parsed, *out);
  float* const normals = !out->normals ? nullptr : w.normals ? w.normals : static_cast<float*>(out->normals);
  const bool coloured = out->colors && open.parsed.header.flags & kFlagColoured;
  uint8_t* const colors = coloured ? static_cast<uint8_t*>(out->colors) : nullptr;
  if (colors) decode_colours(data, open.parsed, w.planes, w.colours, leaves);
  relief_status status = open_patches(o, w, open, normals, colors, leaves);
  if (status != RELIEF_OK) return status;
  MeshWriter& mesh = open.mesh;
  if (!(o.flags & RELIEF_POINTS)) {
    const uint32_t patch_vertices = mesh.vertex_count, patch_triangles = mesh.triangle_count;
    // the seams are those of the whole mesh at level 0; without all patches no surface is closed
    const uint8_t* const seams = open.whole && o.level == 0 ? seams_of(open.parsed, data) : nullptr;
    const bool closed = open.whole && open.parsed.header.flags & kFlagClosed;
    const uint8_t* const seams_end = seams ? data + open.parsed.colours_begin : nullptr;
    status = close_gaps(open.nodes, open.components, {open.spacing, closed, seams, seams_end, nullptr}, mesh,
                        open.gap_memory);
    if (status != RELIEF_OK) return status;
    if (colors) write_gap_colours(mesh, patch_vertices, patch_triangles, colors, o.color_stride);
    stage_done(Stage::kGaps);
    if (!kPlain && o.flags & RELIEF_SMOOTH)  // gap closing takes more a node
      smooth_nodes(open.nodes, patch_vertices, mesh, w.smoothing, reinterpret_cast<int64_t(*)[4]>(w.gaps));
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

relief_status decode(const void* data, size_t size, const relief_options& o, relief_mesh* out,
                     void* workspace, size_t workspace_size, const Leaves& leaves) {
  if (!is_writable(o, out)) return RELIEF_ERROR_ARGUMENT;
  Workspace w;
  OpenPatches open;
  const uint8_t* const bytes = static_cast<const uint8_t*>(data);
  relief_status status = begin(data, size, o, workspace, workspace_size, w, open.parsed);
  if (status == RELIEF_OK) status = read_masks(bytes, o, w, open.parsed, leaves);
  if (status != RELIEF_OK) return status;
  // nothing goes on from here later: gaps take the place of masks or of coefficients, memory that is touched
  // already
  int32_t* const room = room_in_indices(o, w, open.parsed, *out);
  w.gaps = room ? w.planes.mask : reinterpret_cast<uint8_t*>(w.planes.q);
  if (room) w.planes.q = room;
  start_coefficients(w, open.parsed);
  read_coefficients(bytes, w, open.parsed, leaves);
  return make_mesh(bytes, o, w, open, out, leaves);
}

// FNV-1a.
uint64_t hash_of(const uint8_t* data, size_t size) {
  uint64_t h = 0xcbf29ce484222325u;
  for (size_t i = 0; i < size; i++) h = (h ^ data[i]) * 0x100000001b3u;
  return h;
}

// What a mesh of a coarser level did to the masks of a level is undone by making them again.
void restore_masks(const Workspace& w, const Leaves& leaves) {
  for (uint32_t i = 0; i < w.planes.patch_count; i++)
    build_masks(pyramid_of(w.patches[i].width, w.patches[i].height), w.planes.mask + w.planes.begin[i].mask,
                w.planes.mask_scratch, leaves);
}

relief_status decode_more(const void* data, size_t size, const relief_options& o, relief_mesh* out,
                          void* workspace, size_t workspace_size, size_t* taken, const Leaves& leaves) {
  if (!taken || *taken > size || (out && !is_writable(o, out))) return RELIEF_ERROR_ARGUMENT;
  Workspace w;
  OpenPatches open;
  const uint8_t* const bytes = static_cast<const uint8_t*>(data);
  relief_status status = begin(data, size, o, workspace, workspace_size, w, open.parsed);
  if (status != RELIEF_OK) return status;
  const bool whole = !open.parsed.masks_cut();  // else there is nothing to go on from
  const Progress progress = {hash_of(bytes, whole ? open.parsed.coefficients_begin : 0), o.level, o.flags};
  if (*taken == 0) {
    status = read_masks(bytes, o, w, open.parsed, leaves);
    if (status != RELIEF_OK) return status;
    start_coefficients(w, open.parsed);
  } else if (!(*w.progress == progress)) {
    return RELIEF_ERROR_ARGUMENT;
  } else if (o.level > 0) {
    restore_masks(w, leaves);
  }
  read_coefficients(bytes, w, open.parsed, leaves);
  if (whole) *w.progress = progress, *taken = size;
  return out ? make_mesh(bytes, o, w, open, out, leaves) : RELIEF_OK;
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
  if (!is_writable(o, mesh)) return RELIEF_ERROR_ARGUMENT;
  const uint8_t* const bytes = static_cast<const uint8_t*>(data);
  relief_status status = begin(data, size, o, workspace, workspace_size, w, open.parsed);
  if (status == RELIEF_OK) status = read_masks(bytes, o, w, open.parsed, best_leaves());
  if (status != RELIEF_OK) return status;
  start_coefficients(w, open.parsed);
  read_coefficients(bytes, w, open.parsed, best_leaves());
  open.mesh = writer_for(o, w, open.parsed, *mesh);
  return open_patches(o, w, open, nullptr, nullptr, best_leaves());
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
  if (all.vertices > UINT32_MAX || all.triangles > UINT32_MAX || h.vertex_count > o.limits->max_vertices)
    return RELIEF_ERROR_LIMIT;
  if (memory_bound(parsed) > memory_allowed(*o.limits, size))  // with more bytes there may be enough
    return parsed.masks_cut() ? RELIEF_ERROR_TRUNCATED : RELIEF_ERROR_LIMIT;
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
  r.has_colors = parsed.header.flags & kFlagColoured ? 1 : 0;
  *info = r;
  return RELIEF_OK;
}

extern "C" relief_status relief_decode(const void* data, size_t size, const relief_options* options,
                                       relief_mesh* mesh, void* workspace, size_t workspace_size) {
  return decode(data, size, filled_in(options), mesh, workspace, workspace_size, best_leaves());
}

extern "C" relief_status relief_decode_more(const void* data, size_t size, const relief_options* options,
                                            relief_mesh* mesh, void* workspace, size_t workspace_size,
                                            size_t* taken) {
  return decode_more(data, size, filled_in(options), mesh, workspace, workspace_size, taken, best_leaves());
}
