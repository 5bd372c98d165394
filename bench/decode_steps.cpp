// decode_steps STREAM [STEPS] [ROUNDS]: what decoding a stream costs that arrives in so many pieces (5), over one
// relief_decode of it: with a mesh at the end only, so that beside the last mesh all is entropy decoding and what it
// takes to go on with it; and with a mesh after each piece, which is made anew each time. The pieces are the header and
// the masks with equal shares of what follows. On one thread; the least processor time of all rounds.
#include <time.h>

#include "stream_file.h"

namespace {

double now() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) * 1e9 + double(t.tv_nsec);
}

relief_status decode_in_steps(const std::vector<unsigned char>& bytes, int steps, bool every, DecodeMemory& m) {
  size_t taken = 0;
  for (int i = 1; i <= steps; i++) {
    const size_t size = m.info.masks_end + (bytes.size() - m.info.masks_end) * size_t(i) / size_t(steps);
    relief_mesh* const mesh = every || i == steps ? &m.mesh : nullptr;
    const relief_status status =
        relief_decode_more(bytes.data(), size, nullptr, mesh, m.workspace, m.info.workspace_bytes, &taken);
    if (status != RELIEF_OK) return status;
  }
  return RELIEF_OK;
}

template <class Decode>
double least_time(int rounds, relief_status& status, Decode decode) {
  double least = 1e30;
  for (int i = 0; i < rounds && status == RELIEF_OK; i++) {
    const double begin = now();
    status = decode();
    const double took = now() - begin;
    if (took < least) least = took;
  }
  return least;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 4) {
    std::fprintf(stderr, "usage: decode_steps STREAM [STEPS] [ROUNDS]\n");
    return 2;
  }
  const std::vector<unsigned char> bytes = read_file(argv[1]);
  const int steps = argc > 2 ? std::atoi(argv[2]) : 5, rounds = argc > 3 ? std::atoi(argv[3]) : 30;
  DecodeMemory m;
  relief_status status = m.allocate(bytes, true);
  const double once = least_time(rounds, status, [&] { return m.decode(bytes); });
  const double last = least_time(rounds, status, [&] { return decode_in_steps(bytes, steps, false, m); });
  const double every = least_time(rounds, status, [&] { return decode_in_steps(bytes, steps, true, m); });
  if (status != RELIEF_OK) {
    std::fprintf(stderr, "decode_steps: %s: %s\n", argv[1], relief_status_text(status));
    return 1;
  }
  std::printf("once              %8.3f ms\n", once * 1e-6);
  std::printf("%2d steps, one mesh %7.3f ms  %.3f\n", steps, last * 1e-6, last / once);
  std::printf("%2d steps and meshes %6.3f ms  %.3f\n", steps, every * 1e-6, every / once);
  return 0;
}
