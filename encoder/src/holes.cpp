#include "holes.h"

#include <stdexcept>

#include "decode.h"

namespace relief {

DecodedMesh decode_with_faces(const std::vector<uint8_t>& stream) {
  const relief_limits limits = {UINT32_MAX, UINT32_MAX, UINT32_MAX};
  relief_info info;
  relief_status status = relief_inspect(stream.data(), stream.size(), &limits, &info);
  DecodedMesh mesh;
  if (status == RELIEF_OK) {
    mesh.positions.resize(info.vertex_capacity);
    mesh.triangles.resize(info.triangle_capacity);
    mesh.first_triangle.resize(info.triangle_capacity);
    struct alignas(16) Block {
      uint8_t bytes[16];
    };
    std::vector<Block> workspace(info.workspace_bytes / 16 + 1);
    mesh.links.resize(info.vertex_capacity);
    GapTrace trace = {mesh.first_triangle.data(), uint32_t(mesh.first_triangle.size()), 0,
                      reinterpret_cast<uint32_t(*)[2]>(mesh.links.data()), uint32_t(mesh.links.size()), 0};
    relief_mesh out = {};
    out.positions = mesh.positions[0].data();
    out.indices = mesh.triangles[0].data();
    out.vertex_capacity = info.vertex_capacity;
    out.triangle_capacity = info.triangle_capacity;
    status = decode_traced(stream.data(), stream.size(), &limits, &out, workspace.data(),
                           workspace.size() * sizeof(Block), &trace);
    mesh.positions.resize(out.vertex_count);
    mesh.triangles.resize(out.triangle_count);
    mesh.first_triangle.resize(trace.count);
    mesh.links.resize(trace.link_count);
  }
  if (status != RELIEF_OK)
    throw std::logic_error(std::string("the decoder refuses the encoder's stream: ") + relief_status_text(status));
  return mesh;
}

std::vector<uint32_t> find_holes(const DecodedMesh& mesh, const Surface& surface, const DistanceToSurface& distance,
                                 double tolerance) {
  std::vector<Vec3> points;
  std::vector<uint32_t> face_of_point;
  auto lattice = [&](uint32_t v) {
    const auto& p = mesh.positions[v];
    return Vec3((Vec3(p[0], p[1], p[2]) - surface.origin) / surface.scale);
  };
  for (uint32_t f = 0; f < mesh.first_triangle.size(); f++) {
    const uint32_t end = f + 1 < mesh.first_triangle.size() ? mesh.first_triangle[f + 1]
                                                            : uint32_t(mesh.triangles.size());
    for (uint32_t t = mesh.first_triangle[f]; t < end; t++) {
      const auto& v = mesh.triangles[t];
      points.push_back((lattice(v[0]) + lattice(v[1]) + lattice(v[2])) / 3);
      face_of_point.push_back(f);
    }
  }
  std::vector<uint32_t> holes;
  if (points.empty()) return holes;
  const std::vector<float> d = distance(points);
  for (size_t i = 0; i < points.size(); i++)
    if (d[i] > tolerance && (holes.empty() || holes.back() != face_of_point[i])) holes.push_back(face_of_point[i]);
  return holes;
}

}  // namespace relief
