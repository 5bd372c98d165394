/* consumer STREAM OUT: what a program of somebody else does with the decoder. Valid C99 and C++11. Writes
 * positions, normals, indices and, if there are any, colours, one after the other, as they lie in memory. */
#include <relief/relief.h>
#include <stdio.h>
#include <stdlib.h>

static int fail(const char* what, const char* text) {
  fprintf(stderr, "consumer: %s: %s\n", what, text);
  return 1;
}

int main(int argc, char** argv) {
  static unsigned char data[1 << 16];
  relief_info info;
  relief_options options = {NULL, NULL, 0, 0, 0, 0, 0};
  relief_mesh mesh;
  relief_status status;
  size_t size;
  char* memory;
  FILE* file;
  int whole;
  if (argc != 3) return fail("usage", "consumer STREAM OUT");
  file = fopen(argv[1], "rb");
  if (!file) return fail(argv[1], "cannot be opened");
  size = fread(data, 1, sizeof data, file);
  fclose(file);

  options.limits = &relief_default_limits;
  status = relief_inspect(data, size, &options, &info);
  if (status != RELIEF_OK) return fail(argv[1], relief_status_text(status));
  mesh.positions = malloc(12 * (size_t)info.vertex_capacity);
  mesh.normals = malloc(12 * (size_t)info.vertex_capacity);
  mesh.colors = malloc(4 * (size_t)info.vertex_capacity);
  mesh.indices = malloc(12 * (size_t)info.triangle_capacity);
  mesh.vertex_capacity = info.vertex_capacity;
  mesh.triangle_capacity = info.triangle_capacity;
  memory = (char*)malloc((size_t)info.workspace_bytes + 16);
  if (!mesh.positions || !mesh.normals || !mesh.colors || !mesh.indices || !memory) return fail("memory", "none left");
  status = relief_decode(data, size, NULL, &mesh, memory + (16 - (uintptr_t)memory % 16) % 16,
                         (size_t)info.workspace_bytes);
  if (status != RELIEF_OK) return fail(argv[1], relief_status_text(status));

  file = fopen(argv[2], "wb");
  if (!file) return fail(argv[2], "cannot be opened");
  whole = fwrite(mesh.positions, 12, mesh.vertex_count, file) == mesh.vertex_count &&
          fwrite(mesh.normals, 12, mesh.vertex_count, file) == mesh.vertex_count &&
          fwrite(mesh.indices, 12, mesh.triangle_count, file) == mesh.triangle_count &&
          (!info.has_colors || fwrite(mesh.colors, 4, mesh.vertex_count, file) == mesh.vertex_count);
  if (fclose(file) != 0 || !whole) return fail(argv[2], "cannot be written");
  free(memory);
  free(mesh.indices);
  free(mesh.colors);
  free(mesh.normals);
  free(mesh.positions);
  return 0;
}
