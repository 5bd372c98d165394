// decode_time STREAM: decodes a bare stream once, on one thread, and prints the milliseconds that took, from
// bytes in memory to positions and indices in freshly allocated memory. draco_decoder's "ms to decode" counts
// the same.
#include <chrono>

#include "stream_file.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: decode_time STREAM\n");
    return 2;
  }
  const std::vector<unsigned char> bytes = read_file(argv[1]);
  DecodeMemory memory;
  const auto begin = std::chrono::steady_clock::now();
  relief_status status = memory.allocate(bytes, false);
  if (status == RELIEF_OK) status = memory.decode(bytes);
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  if (status != RELIEF_OK) {
    std::fprintf(stderr, "decode_time: %s: %s\n", argv[1], relief_status_text(status));
    return 1;
  }
  std::printf("%.3f ms, %u vertices, %u triangles\n", took.count(), memory.mesh.vertex_count,
              memory.mesh.triangle_count);
  return 0;
}
