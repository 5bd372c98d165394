// decode() of relief/encoder.h: the C API of decoder/ with memory of our own.
#include <algorithm>
#include <cstdlib>
#include <memory>

#include "relief/encoder.h"
#include "relief/relief.h"

namespace relief {
namespace {

// What a stream may ask for: the decoder's own limits let a few bytes ask for more than a machine has. Scans
// take some KB for each byte of their streams.
constexpr uint64_t kMemory = uint64_t(1) << 30, kMemoryAByte = 1 << 16;

uint64_t memory_of(const relief_info& info) {
  return info.workspace_bytes + uint64_t(info.vertex_capacity) * 2 * sizeof(float[3]) +
         uint64_t(info.triangle_capacity) * sizeof(uint32_t[3]);
}

}  // namespace

TriangleMesh decode(const uint8_t* data, size_t size, const DecodeOptions& options) {
  const uint64_t most = kMemory + kMemoryAByte * size;
  size = size_t(std::min<uint64_t>(size, options.bytes));
  auto check = [](relief_status status) {
    if (status != RELIEF_OK) throw InputError(relief_status_text(status));
  };
  relief_info info;
  check(relief_inspect(data, size, nullptr, &info));
  if (memory_of(info) > most) throw InputError("the stream asks for more memory than one of its size may");

  TriangleMesh mesh;
  mesh.positions.resize(info.vertex_capacity);
  mesh.normals.resize(info.vertex_capacity);
  mesh.triangles.resize(info.triangle_capacity);
  constexpr size_t kAlignment = 16;
  size_t workspace_size = (size_t(info.workspace_bytes) + kAlignment - 1) / kAlignment * kAlignment;
  std::unique_ptr<void, void (*)(void*)> workspace(
      std::aligned_alloc(kAlignment, workspace_size ? workspace_size : kAlignment), &std::free);
  if (!workspace) throw std::bad_alloc();

  relief_mesh out{};
  out.positions = reinterpret_cast<float*>(mesh.positions.data());
  out.normals = reinterpret_cast<float*>(mesh.normals.data());
  out.indices = reinterpret_cast<uint32_t*>(mesh.triangles.data());
  out.vertex_capacity = info.vertex_capacity;
  out.triangle_capacity = info.triangle_capacity;
  auto* const run = options.smooth ? relief_decode_smoothed : relief_decode;
  check(run(data, size, nullptr, &out, workspace.get(), workspace_size));
  mesh.positions.resize(out.vertex_count);
  mesh.normals.resize(out.vertex_count);
  mesh.triangles.resize(out.triangle_count);
  return mesh;
}

}  // namespace relief
