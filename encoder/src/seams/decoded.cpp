#include "seams/decoded.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "surface/sets.h"

namespace relief {

namespace {

constexpr relief_limits kNoLimits = {UINT32_MAX, UINT32_MAX, UINT32_MAX, UINT64_MAX};
constexpr relief_options kAnything = {&kNoLimits, nullptr, 0, 0, 0, 0, 0};

void check(relief_status status) {
  if (status != RELIEF_OK)
    throw std::logic_error(std::string("the decoder refuses the encoder's stream: ") +
                           relief_status_text(status));
}

// The numbers that the first vertex, triangle, node, loop and component of a patch have in the mesh.
struct Firsts {
  uint32_t vertex = 0, triangle = 0, node = 0, loop = 0, component = 0;
};

Firsts behind(const Firsts& f, const MeshedPatch& p) {
  return {f.vertex + uint32_t(p.positions.size()), f.triangle + uint32_t(p.triangles.size()),
          f.node + uint32_t(p.nodes.size()), f.loop + uint32_t(p.loop_length.size()),
          f.component + p.components};
}

void copy(const MeshedPatch& p, uint32_t index, const Firsts& first, TriangleMesh& mesh, Nodes& nodes) {
  std::copy(p.positions.begin(), p.positions.end(), mesh.positions.begin() + first.vertex);
  for (size_t t = 0; t < p.triangles.size(); t++)
    for (size_t k = 0; k < 3; k++) mesh.triangles[first.triangle + t][k] = p.triangles[t][k] + first.vertex;
  std::copy(p.loop_length.begin(), p.loop_length.end(), nodes.loop_length + first.loop);
  for (size_t i = 0; i < p.nodes.size(); i++) {
    Node n = p.nodes[i];
    n.next += first.node, n.prev += first.node;
    n.loop += first.loop;
    n.patch = index;
    n.component += first.component;
    n.vertex += first.vertex;
    nodes[uint32_t(first.node + i)] = n;
  }
}

}  // namespace

PatchDecoder::PatchDecoder(const std::vector<uint8_t>& stream) {
  relief_info info;
  check(relief_inspect(stream.data(), stream.size(), &kAnything, &info));
  mesh_.positions.resize(info.vertex_capacity);
  mesh_.triangles.resize(info.triangle_capacity);
  const size_t blocks = info.workspace_bytes / sizeof(Block) + 1;
  workspace_ = std::make_unique_for_overwrite<Block[]>(blocks);
  relief_mesh out = {};
  out.positions = mesh_.positions[0].data();
  out.indices = mesh_.triangles[0].data();
  out.vertex_capacity = info.vertex_capacity;
  out.triangle_capacity = info.triangle_capacity;
  check(decode_patches(stream.data(), stream.size(), &kAnything, &out, workspace_.get(),
                       blocks * sizeof(Block), open_));
  start_trace();
}

PatchDecoder::PatchDecoder(const std::vector<const MeshedPatch*>& patches, const StreamPlacement& placement) {
  std::vector<Firsts> first(patches.size() + 1);
  for (size_t i = 0; i < patches.size(); i++) first[i + 1] = behind(first[i], *patches[i]);
  const Firsts& count = first.back();
  const uint64_t triangles = 2 * uint64_t(count.vertex) + gap_triangles(count.node);
  mesh_.positions.resize(count.vertex + gap_vertices(count.node));
  mesh_.triangles.resize(triangles);
  auto lay_out = [&](void* memory) {
    Arena a(memory);
    open_.nodes.allocate(a, count.node);
    open_.gap_memory = a.take<uint8_t>(gap_memory_bytes(count.node));
    return a.used;
  };
  workspace_ = std::make_unique_for_overwrite<Block[]>(lay_out(nullptr) / sizeof(Block) + 1);
  lay_out(workspace_.get());
  tbb::parallel_for(size_t(0), patches.size(),
                    [&](size_t i) { copy(*patches[i], uint32_t(i), first[i], mesh_, open_.nodes); });
  open_.nodes.count = count.node, open_.nodes.loop_count = count.loop;
  open_.components = count.component;
  open_.whole = true;
  StreamHeader& h = open_.parsed.header;
  h = {};
  h.flags = placement.closed ? kFlagClosed : 0;
  std::copy_n(placement.origin, 3, h.origin);
  h.scale = placement.scale;
  open_.mesh = {mesh_.positions[0].data(),
                mesh_.triangles[0].data(),
                uint32_t(mesh_.positions.size()),
                uint32_t(mesh_.triangles.size()),
                count.vertex,
                count.triangle};
  open_.spacing = 0;
  for (const MeshedPatch* p : patches)
    if (!p->nodes.empty()) open_.spacing = std::max(open_.spacing, p->nodes[0].spacing);
  start_trace();
}

// Room for what a trace may fill.
void PatchDecoder::start_trace() {
  const size_t nodes = open_.nodes.count;
  first_triangle_.resize(gap_triangles(nodes));
  links_.resize(2 * mesh_.positions.size());
  kind_.resize(links_.size());
  nodes_.resize(nodes);
}

DecodedMesh PatchDecoder::close(const Seams& seams, DecodedMesh spare) {
  const std::vector<uint8_t> bytes = code_seams(seams);
  std::vector<std::pair<uint32_t, std::array<uint32_t, 3>>> joined;  // by tubes, which write over them
  for (const auto& tube : seams.tubes)
    for (uint32_t t : tube) joined.push_back({t, mesh_.triangles[t]});
  DecodedMesh d = close(bytes.data(), bytes.data() + bytes.size(), std::move(spare));
  for (const auto& [t, corners] : joined) {
    d.mesh.triangles[t] = mesh_.triangles[t];  // a spare one has those of the patches
    mesh_.triangles[t] = corners;
  }
  return d;
}

DecodedMesh PatchDecoder::close(const uint8_t* seams, const uint8_t* end, DecodedMesh d) {
  GapTrace trace = {};
  trace.first_triangle = first_triangle_.data();
  trace.capacity = uint32_t(first_triangle_.size());
  trace.links = reinterpret_cast<uint32_t(*)[2]>(links_.data());
  trace.kind = kind_.data();
  trace.link_capacity = uint32_t(links_.size());
  trace.nodes = nodes_.data();
  trace.node_capacity = uint32_t(nodes_.size());
  trace.partners_known = std::exchange(partners_known_, true);
  const bool closed = open_.parsed.header.flags & kFlagClosed;
  const GapOptions options = {open_.spacing, closed, seams, end, &trace};
  MeshWriter mesh = open_.mesh;  // what was added before is written over
  check(close_gaps(open_.nodes, open_.components, options, mesh, open_.gap_memory));
  const bool fresh = d.mesh.positions.size() < open_.mesh.vertex_count;
  const auto vertex = fresh ? 0 : ptrdiff_t(open_.mesh.vertex_count);
  const auto triangle = fresh ? 0 : ptrdiff_t(open_.mesh.triangle_count);
  d.mesh.positions.resize(size_t(vertex));
  d.mesh.triangles.resize(size_t(triangle));
  d.mesh.positions.insert(d.mesh.positions.end(), mesh_.positions.begin() + vertex,
                          mesh_.positions.begin() + mesh.vertex_count);
  d.mesh.triangles.insert(d.mesh.triangles.end(), mesh_.triangles.begin() + triangle,
                          mesh_.triangles.begin() + mesh.triangle_count);
  place(open_.parsed.header, d.mesh.positions.data()->data() + 3 * vertex,
        mesh.vertex_count - uint32_t(vertex));
  d.first_triangle.assign(first_triangle_.begin(), first_triangle_.begin() + trace.count);
  d.links.assign(links_.begin(), links_.begin() + trace.link_count);
  d.kind.assign(kind_.begin(), kind_.begin() + trace.link_count);
  d.nodes.assign(nodes_.begin(), nodes_.begin() + trace.node_count);
  return d;
}

DecodedMesh decode_with_seams(const std::vector<uint8_t>& stream) {
  PatchDecoder decoder(stream);
  return decoder.close(seams_of(decoder.parsed(), stream.data()),
                       stream.data() + decoder.parsed().colours_begin);
}

std::vector<Pixel> pixels_of(const std::vector<CodedPatch>& patches) {
  std::vector<Pixel> pixels;
  for (uint32_t p = 0; p < patches.size(); p++) {
    const uint32_t size = patches[p].header.width * patches[p].header.height;
    for (uint32_t i = 0; i < size; i++)
      if (patches[p].mask[i]) pixels.push_back({p, i});
  }
  return pixels;
}

std::vector<int> connected_parts(const TriangleMesh& mesh, size_t count, int& parts) {
  Sets sets(mesh.positions.size());
  std::vector<int> part(mesh.positions.size(), -1);
  for (size_t t = 0; t < count; t++) {
    const auto& [a, b, c] = mesh.triangles[t];
    sets.join(a, b);
    sets.join(b, c);
    for (uint32_t v : mesh.triangles[t]) part[v] = 0;
  }
  std::vector<int> number(mesh.positions.size(), -1);
  parts = 0;
  for (uint32_t v = 0; v < part.size(); v++) {
    if (part[v] < 0) continue;
    int& n = number[sets.find(v)];
    if (n < 0) n = parts++;
    part[v] = n;
  }
  return part;
}

int join_across_gaps(const DecodedMesh& d, const std::vector<int>& part, int parts,
                     std::vector<int>* joined) {
  const size_t pixels = part.size();  // vertices from there on are in gaps only
  Sets sets(size_t(parts) + d.mesh.positions.size() - pixels);
  auto set_of = [&](uint32_t v) { return v < pixels ? uint32_t(part[v]) : uint32_t(parts + v - pixels); };
  for (size_t t = d.patch_triangles(); t < d.mesh.triangles.size(); t++) {
    const auto& [a, b, c] = d.mesh.triangles[t];
    sets.join(set_of(a), set_of(b));
    sets.join(set_of(b), set_of(c));
  }
  if (joined) {
    joined->resize(pixels);
    for (size_t v = 0; v < pixels; v++) (*joined)[v] = int(sets.find(uint32_t(part[v])));
  }
  return int(sets.count());
}

}  // namespace relief
