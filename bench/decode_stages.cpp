// decode_stages STREAM [ROUNDS]: where the time of a decode goes, positions, normals and indices, on one
// thread, in memory that is there already. The least processor time of all rounds for each stage and for the
// whole: other programs on the machine disturb it little.
#include <time.h>

#include "container.h"
#include "stage.h"
#include "stream_file.h"

namespace {

constexpr int kStages = int(relief::Stage::kStages);

double g_spent[kStages];  // nanoseconds of the round at hand
double g_last;

double now() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) * 1e9 + double(t.tv_nsec);
}

void print_row(const char* name, double nanoseconds, double all, uint32_t vertices) {
  std::printf("%-14s %8.3f ms %5.1f%% %7.1f ns a vertex\n", name, nanoseconds * 1e-6, 100 * nanoseconds / all,
              nanoseconds / vertices);
}

}  // namespace

void relief::stage_done(Stage stage) {
  const double time = now();
  g_spent[int(stage)] += time - g_last;
  g_last = time;
}

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: decode_stages STREAM [ROUNDS]\n");
    return 2;
  }
  const std::vector<unsigned char> bytes = read_file(argv[1]);
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 50;
  DecodeMemory memory;
  relief_status status = memory.allocate(bytes, true);
  double least[kStages], whole = 1e30;
  for (double& l : least) l = 1e30;
  for (int round = 0; round < rounds && status == RELIEF_OK; round++) {
    for (double& s : g_spent) s = 0;
    const double begin = g_last = now();
    status = memory.decode(bytes);
    const double took = now() - begin;
    if (took < whole) whole = took;
    for (int i = 0; i < kStages; i++)
      if (g_spent[i] < least[i]) least[i] = g_spent[i];
  }
  relief::Parsed parsed;
  if (status == RELIEF_OK)
    status = relief::parse_header(bytes.data(), bytes.size(), relief_default_limits, parsed);
  if (status != RELIEF_OK) {
    std::fprintf(stderr, "decode_stages: %s: %s\n", argv[1], relief_status_text(status));
    return 1;
  }
  const char* const names[kStages] = {"patch table", "masks", "coefficients", "wavelet",
                                      "meshing",     "gaps",  "normals",      "placement"};
  for (int i = 0; i < kStages; i++) print_row(names[i], least[i], whole, memory.mesh.vertex_count);
  print_row("whole", whole, whole, memory.mesh.vertex_count);
  const uint32_t nodes = parsed.header.boundary_nodes;
  std::printf("gaps: %.0f ns a border vertex of %u\n", least[int(relief::Stage::kGaps)] / nodes, nodes);
  return 0;
}
