// decode_time STREAM: decodes a bare stream once, on one thread, and prints the milliseconds that took, from
// bytes in memory to positions and indices in freshly allocated memory. draco_decoder's "ms to decode" counts
// the same.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "relief/relief.h"

static std::vector<unsigned char> read_file(const char* path) {
  std::vector<unsigned char> bytes;
  FILE* file = std::fopen(path, "rb");
  if (!file) return bytes;
  unsigned char block[1 << 16];
  for (size_t n; (n = std::fread(block, 1, sizeof block, file)) > 0;)
    bytes.insert(bytes.end(), block, block + n);
  std::fclose(file);
  return bytes;
}

static relief_status decode(const std::vector<unsigned char>& bytes, relief_mesh& mesh) {
  relief_info info;
  relief_status status = relief_inspect(bytes.data(), bytes.size(), nullptr, &info);
  if (status != RELIEF_OK) return status;
  mesh = {};
  mesh.vertex_capacity = info.vertex_capacity;
  mesh.triangle_capacity = info.triangle_capacity;
  mesh.positions = static_cast<float*>(std::malloc(12 * size_t(info.vertex_capacity)));
  mesh.indices = static_cast<uint32_t*>(std::malloc(12 * size_t(info.triangle_capacity)));
  void* workspace = std::aligned_alloc(16, (info.workspace_bytes + 15) / 16 * 16);
  if (!mesh.positions || !mesh.indices || !workspace) return RELIEF_ERROR_WORKSPACE;
  status = relief_decode(bytes.data(), bytes.size(), nullptr, &mesh, workspace, info.workspace_bytes);
  std::free(workspace);
  return status;
}

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: decode_time STREAM\n");
    return 2;
  }
  const std::vector<unsigned char> bytes = read_file(argv[1]);
  relief_mesh mesh;
  const auto begin = std::chrono::steady_clock::now();
  const relief_status status = decode(bytes, mesh);
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  if (status != RELIEF_OK) {
    std::fprintf(stderr, "decode_time: %s: %s\n", argv[1], relief_status_text(status));
    return 1;
  }
  std::printf("%.3f ms, %u vertices, %u triangles\n", took.count(), mesh.vertex_count, mesh.triangle_count);
  std::free(mesh.positions);
  std::free(mesh.indices);
  return 0;
}
