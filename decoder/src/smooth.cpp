#include "smooth.h"

#include <string.h>

namespace relief {

void smooth_nodes(const Nodes& nodes, uint32_t patch_vertices, MeshWriter& mesh, uint32_t* node_of,
                  int64_t (*sums)[4]) {
  for (uint32_t v = 0; v < patch_vertices; v++) node_of[v] = kNone;
  for (uint32_t n = 0; n < nodes.count; n++) node_of[nodes[n].vertex] = n;
  memset(sums, 0, size_t(nodes.count) * sizeof(*sums));
  for (uint32_t t = 0; t < mesh.triangle_count; t++) {
    const uint32_t* v = mesh.indices + 3 * size_t(t);
    for (int k = 0; k < 3; k++) {
      if (v[k] >= patch_vertices || node_of[v[k]] == kNone) continue;
      int64_t* const sum = sums[node_of[v[k]]];
      for (int other = 1; other < 3;
           other++) {  // each neighbour comes twice, but for those along an open border
        const float* p = mesh.positions + 3 * size_t(v[(k + other) % 3]);
        for (int i = 0; i < 3; i++) sum[i] += int64_t(p[i]);
        sum[3]++;
      }
    }
  }
  for (uint32_t n = 0; n < nodes.count; n++) {
    if (sums[n][3] == 0) continue;
    float* p = mesh.positions + 3 * size_t(nodes[n].vertex);
    for (int i = 0; i < 3; i++) p[i] = float(int64_t(p[i]) + (sums[n][i] / sums[n][3] - int64_t(p[i])) / 3);
  }
}

}  // namespace relief
