#include "seams/decoded.h"

#include <numeric>
#include <stdexcept>

#include "decode.h"

namespace relief {

DecodedMesh decode_with_seams(const std::vector<uint8_t>& stream) {
  const relief_limits limits = {UINT32_MAX, UINT32_MAX, UINT32_MAX};
  relief_info info;
  relief_status status = relief_inspect(stream.data(), stream.size(), &limits, &info);
  DecodedMesh d;
  if (status == RELIEF_OK) {
    d.mesh.positions.resize(info.vertex_capacity);
    d.mesh.triangles.resize(info.triangle_capacity);
    d.first_triangle.resize(info.triangle_capacity);
    d.links.resize(2 * size_t(info.vertex_capacity));
    d.kind.resize(d.links.size());
    d.nodes.resize(info.vertex_capacity);
    struct alignas(16) Block {
      uint8_t bytes[16];
    };
    std::vector<Block> workspace(info.workspace_bytes / 16 + 1);
    GapTrace trace = {};
    trace.first_triangle = d.first_triangle.data();
    trace.capacity = uint32_t(d.first_triangle.size());
    trace.links = reinterpret_cast<uint32_t(*)[2]>(d.links.data());
    trace.kind = d.kind.data();
    trace.link_capacity = uint32_t(d.links.size());
    trace.nodes = d.nodes.data();
    trace.node_capacity = uint32_t(d.nodes.size());
    relief_mesh out = {};
    out.positions = d.mesh.positions[0].data();
    out.indices = d.mesh.triangles[0].data();
    out.vertex_capacity = info.vertex_capacity;
    out.triangle_capacity = info.triangle_capacity;
    status = decode_traced(stream.data(), stream.size(), &limits, &out, workspace.data(),
                           workspace.size() * sizeof(Block), false, &trace);
    d.mesh.positions.resize(out.vertex_count);
    d.mesh.triangles.resize(out.triangle_count);
    d.first_triangle.resize(trace.count);
    d.links.resize(trace.link_count);
    d.kind.resize(trace.link_count);
    d.nodes.resize(trace.node_count);
  }
  if (status != RELIEF_OK)
    throw std::logic_error(std::string("the decoder refuses the encoder's stream: ") +
                           relief_status_text(status));
  return d;
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
  std::vector<uint32_t> parent(mesh.positions.size());
  std::iota(parent.begin(), parent.end(), 0u);
  auto find = [&](uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  std::vector<int> part(mesh.positions.size(), -1);
  for (size_t t = 0; t < count; t++) {
    const auto& [a, b, c] = mesh.triangles[t];
    parent[find(a)] = find(b);
    parent[find(b)] = find(c);
    for (uint32_t v : mesh.triangles[t]) part[v] = 0;
  }
  std::vector<int> number(mesh.positions.size(), -1);
  parts = 0;
  for (uint32_t v = 0; v < part.size(); v++) {
    if (part[v] < 0) continue;
    int& n = number[find(v)];
    if (n < 0) n = parts++;
    part[v] = n;
  }
  return part;
}

}  // namespace relief
