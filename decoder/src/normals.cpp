#include "normals.h"

namespace relief {

void add_normals(const MeshWriter& mesh, float* normals) {
  const float* p = mesh.positions;
  for (uint32_t t = 0; t < mesh.triangle_count; t++) {
    const uint32_t* v = mesh.indices + 3 * size_t(t);
    const float *a = p + 3 * size_t(v[0]), *b = p + 3 * size_t(v[1]), *c = p + 3 * size_t(v[2]);
    const float ux = b[0] - a[0], uy = b[1] - a[1], uz = b[2] - a[2];
    const float vx = c[0] - a[0], vy = c[1] - a[1], vz = c[2] - a[2];
    const float nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    for (int k = 0; k < 3; k++) {
      float* n = normals + 3 * size_t(v[k]);
      n[0] += nx, n[1] += ny, n[2] += nz;
    }
  }
}

}  // namespace relief
