// What the timing programs share: a stream from a file, and memory to decode it into.
#pragma once
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "relief/relief.h"

inline std::vector<unsigned char> read_file(const char* path) {
  std::vector<unsigned char> bytes;
  FILE* file = std::fopen(path, "rb");
  if (!file) return bytes;
  unsigned char block[1 << 16];
  for (size_t n; (n = std::fread(block, 1, sizeof block, file)) > 0;)
    bytes.insert(bytes.end(), block, block + n);
  std::fclose(file);
  return bytes;
}

// Memory for one decode of a stream; kept from one decode to the next.
struct DecodeMemory {
  relief_info info = {};
  relief_mesh mesh = {};
  void* workspace = nullptr;

  relief_status allocate(const std::vector<unsigned char>& bytes, bool normals) {
    const relief_status status = relief_inspect(bytes.data(), bytes.size(), nullptr, &info);
    if (status != RELIEF_OK) return status;
    mesh.vertex_capacity = info.vertex_capacity;
    mesh.triangle_capacity = info.triangle_capacity;
    mesh.positions = std::malloc(12 * size_t(info.vertex_capacity));
    if (normals) mesh.normals = std::malloc(12 * size_t(info.vertex_capacity));
    mesh.indices = std::malloc(12 * size_t(info.triangle_capacity));
    workspace = std::aligned_alloc(16, (info.workspace_bytes + 15) / 16 * 16);
    const bool all = mesh.positions && (mesh.normals || !normals) && mesh.indices && workspace;
    return all ? RELIEF_OK : RELIEF_ERROR_WORKSPACE;
  }
  relief_status decode(const std::vector<unsigned char>& bytes) {
    return relief_decode(bytes.data(), bytes.size(), nullptr, &mesh, workspace, info.workspace_bytes);
  }
  ~DecodeMemory() {
    std::free(mesh.positions);
    std::free(mesh.normals);
    std::free(mesh.indices);
    std::free(workspace);
  }
};
