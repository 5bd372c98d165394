// decode_raw STREAM OUT: decodes a bare stream and writes positions, normals, indices and, if there are any,
// colours, one after the other, as they lie in memory. The JavaScript tests compare these bytes with what the WebAssembly decoder
// returns.
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "golden.h"
#include "relief/relief.h"

template <class T>
static bool write(FILE* file, const std::vector<T>& values, size_t count) {
  return std::fwrite(values.data(), sizeof(T), count, file) == count;
}

static int fail(const char* what, const char* text) {
  std::fprintf(stderr, "decode_raw: %s: %s\n", what, text);
  return 1;
}

int main(int argc, char** argv) {
  if (argc != 3) return fail("usage", "decode_raw STREAM OUT");
  const std::vector<uint8_t> bytes = relief::read_bytes(argv[1]);
  relief_info info;
  relief_status status = relief_inspect(bytes.data(), bytes.size(), nullptr, &info);
  if (status != RELIEF_OK) return fail(argv[1], relief_status_text(status));

  std::vector<float> positions(3 * size_t(info.vertex_capacity)), normals(positions.size());
  std::vector<uint8_t> colors(info.has_colors ? 4 * size_t(info.vertex_capacity) : 0);
  std::vector<uint32_t> indices(3 * size_t(info.triangle_capacity));
  void* workspace = std::aligned_alloc(16, (info.workspace_bytes + 15) / 16 * 16);
  relief_mesh mesh = {};
  mesh.positions = positions.data(), mesh.normals = normals.data(), mesh.indices = indices.data();
  mesh.colors = colors.data();
  mesh.vertex_capacity = info.vertex_capacity, mesh.triangle_capacity = info.triangle_capacity;
  status = relief_decode(bytes.data(), bytes.size(), nullptr, &mesh, workspace, info.workspace_bytes);
  std::free(workspace);
  if (status != RELIEF_OK) return fail(argv[1], relief_status_text(status));

  FILE* file = std::fopen(argv[2], "wb");
  if (!file) return fail(argv[2], "cannot be written");
  const bool whole = write(file, positions, 3 * size_t(mesh.vertex_count)) &&
                     write(file, normals, 3 * size_t(mesh.vertex_count)) &&
                     write(file, indices, 3 * size_t(mesh.triangle_count)) &&
                     write(file, colors, info.has_colors ? 4 * size_t(mesh.vertex_count) : 0);
  if (std::fclose(file) != 0 || !whole) return fail(argv[2], "cannot be written");
  return 0;
}
