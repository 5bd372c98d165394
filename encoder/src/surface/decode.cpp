// decode() of relief/encoder.h: the C API of decoder/ with memory of our own.
#include <algorithm>
#include <cstdlib>
#include <memory>

#include "relief/encoder.h"
#include "relief/relief.h"

namespace relief {

TriangleMesh decode(const uint8_t* data, size_t size, const DecodeOptions& options) {
  size = size_t(std::min<uint64_t>(size, options.bytes));
  auto check = [](relief_status status) {
    if (status != RELIEF_OK) throw InputError(relief_status_text(status));
  };
  relief_options wanted{};
  wanted.level = options.level;
  if (options.smooth) wanted.flags |= RELIEF_SMOOTH;
  if (options.points) wanted.flags |= RELIEF_POINTS;
  relief_info info;
  check(relief_inspect(data, size, &wanted, &info));

  TriangleMesh mesh;
  mesh.positions.resize(info.vertex_capacity);
  mesh.normals.resize(info.vertex_capacity);
  if (info.has_colors) mesh.colors.resize(info.vertex_capacity);
  mesh.triangles.resize(info.triangle_capacity);
  constexpr size_t kAlignment = 16;
  size_t workspace_size = (size_t(info.workspace_bytes) + kAlignment - 1) / kAlignment * kAlignment;
  std::unique_ptr<void, void (*)(void*)> workspace(
      std::aligned_alloc(kAlignment, workspace_size ? workspace_size : kAlignment), &std::free);
  if (!workspace) throw std::bad_alloc();

  relief_mesh out{};
  out.positions = mesh.positions.data();
  out.normals = mesh.normals.data();
  out.colors = mesh.colors.data();
  out.indices = mesh.triangles.data();
  out.vertex_capacity = info.vertex_capacity;
  out.triangle_capacity = info.triangle_capacity;
  check(relief_decode(data, size, &wanted, &out, workspace.get(), workspace_size));
  if (out.vertex_count == 0)
    throw InputError("there is nothing of the surface at this level, or in so few bytes");
  mesh.positions.resize(out.vertex_count);
  mesh.normals.resize(out.vertex_count);
  if (info.has_colors) mesh.colors.resize(out.vertex_count);
  mesh.triangles.resize(out.triangle_count);
  return mesh;
}

}  // namespace relief
