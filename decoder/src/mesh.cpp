#include "mesh.h"

#include <string.h>

#include "diagonal.h"

namespace relief {
namespace {

struct Patch {
  const PatchHeader& header;
  uint32_t index;
  int32_t spacing;
  int w, h;
  const uint8_t* mask;  // pixel (0, 0)
  ptrdiff_t stride;
  const MeshScratch& s;
  MeshWriter& mesh;
  Nodes& nodes;

  const uint8_t* at(int x, int y) const { return mask + y * stride + x; }
  size_t pixel(int x, int y) const { return size_t(y) * size_t(w) + size_t(x); }

  // Cell (x, y) has its pixels at (x, y) .. (x+1, y+1); covered if at least three are in the mask.
  int count(int x, int y) const {
    const uint8_t* p = at(x, y);
    return p[0] + p[1] + p[stride] + p[stride + 1];
  }
  bool covered(int x, int y) const { return x >= 0 && y >= 0 && x + 1 < w && y + 1 < h && count(x, y) >= 3; }
};

// From (x, y) to (x+1, y+1), where the neighbours that could tell are missing.
bool main_diagonal(const Patch& p, int x, int y) {
  if (x < 1 || y < 1 || x + 2 >= p.w || y + 2 >= p.h) return true;
  const uint8_t* m = p.at(x, y);
  if (!(m[-p.stride - 1] & m[-p.stride + 2] & m[2 * p.stride - 1] & m[2 * p.stride + 2])) return true;
  return predict_main_diagonal(p.s.height + p.pixel(x, y), p.w);
}

relief_status add_vertices(const Patch& p, float spacing, const float* z) {
  const Frame f = frame_of(p.header.u, p.header.v);
  float a[3], b[3], n[3], o[3];
  const float offset = float(p.header.z0) * spacing;
  for (int i = 0; i < 3; i++) {
    a[i] = float(f.e1[i]) * spacing;
    b[i] = float(f.e2[i]) * spacing;
    n[i] = float(f.n[i]);
    o[i] = n[i] * offset;
  }
  MeshWriter& mesh = p.mesh;
  for (int y = 0; y < p.h; y++) {
    const float fy = float(p.header.y0 + y);
    const float row[3] = {o[0] + fy * b[0], o[1] + fy * b[1], o[2] + fy * b[2]};
    const uint8_t* m = p.at(0, y);
    for (int x = 0; x < p.w; x++) {
      if (!m[x]) continue;
      if (mesh.vertex_count == mesh.vertex_capacity) return RELIEF_ERROR_OUTPUT;
      const size_t i = p.pixel(x, y);
      const float fx = float(p.header.x0 + x);
      float* out = mesh.positions + 3 * size_t(mesh.vertex_count);
      for (int k = 0; k < 3; k++) out[k] = float(to_lattice((row[k] + fx * a[k]) + z[i] * n[k]));
      p.s.height[i] = to_lattice(z[i]);
      p.s.vertex[i] = mesh.vertex_count++;
      p.s.node[i] = kNone;
    }
  }
  return RELIEF_OK;
}

uint32_t find(uint32_t* parent, uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

// Triangles of all cells; runs of cells that share a side are joined to connected pieces of the patch.
relief_status add_triangles(const Patch& p, uint32_t& runs) {
  MeshWriter& mesh = p.mesh;
  const int w = p.w;
  runs = 0;
  for (int y = 0; y + 1 < p.h; y++) {
    bool open = false;  // the cell to the left is covered and shares its right side
    for (int x = 0; x + 1 < w; x++) {
      const uint8_t* m = p.at(x, y);
      const int n = m[0] + m[1] + m[p.stride] + m[p.stride + 1];
      if (n < 3) {
        open = false;
        continue;
      }
      if (mesh.triangle_capacity - mesh.triangle_count < uint32_t(n - 2)) return RELIEF_ERROR_OUTPUT;
      const size_t i = p.pixel(x, y);
      const uint32_t *v = p.s.vertex + i, a = v[0], b = v[1], c = v[w], d = v[w + 1];
      uint32_t* out = mesh.indices + 3 * size_t(mesh.triangle_count);
      if (n == 4) {
        if (main_diagonal(p, x, y))
          out[0] = a, out[1] = b, out[2] = d, out[3] = a, out[4] = d, out[5] = c;
        else
          out[0] = a, out[1] = b, out[2] = c, out[3] = b, out[4] = d, out[5] = c;
        mesh.triangle_count += 2;
      } else {
        if (!m[0])
          out[0] = b, out[1] = d, out[2] = c;
        else if (!m[1])
          out[0] = a, out[1] = d, out[2] = c;
        else if (!m[p.stride])
          out[0] = a, out[1] = b, out[2] = d;
        else
          out[0] = a, out[1] = b, out[2] = c;
        mesh.triangle_count++;
      }
      uint32_t* run = p.s.run_of_cell;
      if (!open) p.s.run[runs] = runs, runs++;
      run[i] = open ? run[i - 1] : runs - 1;
      if (y > 0 && m[0] && m[1] && p.covered(x, y - 1))
        p.s.run[find(p.s.run, run[i])] = find(p.s.run, run[i - size_t(w)]);
      open = m[1] && m[p.stride + 1];
    }
  }
  return RELIEF_OK;
}

// Normal at a border pixel: the sum over the triangles between it and its neighbours in covered cells.
void node_normal(const Patch& p, int x, int y, int16_t out[3]) {
  static const int kRing[9][2] = {{1, 0},   {1, 1},  {0, 1},  {-1, 1}, {-1, 0},
                                  {-1, -1}, {0, -1}, {1, -1}, {1, 0}};
  auto position = [&](int px, int py, int64_t v[3]) {
    const float* f = p.mesh.positions + 3 * size_t(p.s.vertex[p.pixel(px, py)]);
    for (int k = 0; k < 3; k++) v[k] = int64_t(f[k]);
  };
  int64_t centre[3], sum[3] = {0, 0, 0};
  position(x, y, centre);
  for (int q = 0; q < 4; q++) {  // the cells around: q-th spans kRing[2q] .. kRing[2q + 2]
    const int cx = q == 0 || q == 3 ? x : x - 1, cy = q < 2 ? y : y - 1;
    if (!p.covered(cx, cy)) continue;
    int64_t previous[3];
    bool have = false;
    for (int k = 2 * q; k <= 2 * q + 2; k++) {
      const int nx = x + kRing[k][0], ny = y + kRing[k][1];
      if (!*p.at(nx, ny)) continue;
      int64_t here[3], c[3];
      position(nx, ny, here);
      for (int i = 0; i < 3; i++) here[i] -= centre[i];
      if (have) {
        cross(previous, here, c);
        for (int i = 0; i < 3; i++) sum[i] += c[i];
      }
      for (int i = 0; i < 3; i++) previous[i] = here[i];
      have = true;
    }
  }
  unit_vector(sum, out);
}

// The node of a pixel, made on its first use. kNone if there is no room.
uint32_t node_at(const Patch& p, int x, int y, uint32_t run) {
  uint32_t& node = p.s.node[p.pixel(x, y)];
  if (node != kNone) return node;
  Nodes& n = p.nodes;
  if (n.count == n.capacity) return kNone;
  node = n.count++;
  const float* v = p.mesh.positions + 3 * size_t(p.s.vertex[p.pixel(x, y)]);
  for (int k = 0; k < 3; k++) n.position[node][k] = int32_t(v[k]);
  node_normal(p, x, y, n.normal[node]);
  n.vertex[node] = p.s.vertex[p.pixel(x, y)];
  n.next[node] = n.prev[node] = kNone;
  n.patch[node] = p.index;
  n.spacing[node] = p.spacing;
  n.component[node] = run;
  n.pixel[node][0] = uint16_t(x);
  n.pixel[node][1] = uint16_t(y);
  return node;
}

// Sides of covered cells with no covered cell across become the border, counter-clockwise around the patch.
relief_status add_border(const Patch& p) {
  for (int y = 0; y + 1 < p.h; y++)
    for (int x = 0; x + 1 < p.w; x++) {
      const uint8_t* m = p.at(x, y);
      const bool a = m[0], b = m[1], c = m[p.stride], d = m[p.stride + 1];
      if (a + b + c + d < 3) continue;
      const uint32_t run = find(p.s.run, p.s.run_of_cell[p.pixel(x, y)]);
      bool ok = true;
      auto side = [&](int x0, int y0, int x1, int y1) {
        const uint32_t u = node_at(p, x0, y0, run), v = node_at(p, x1, y1, run);
        // a second side that leaves u or arrives at v: the border touches itself there
        if (u == kNone || v == kNone || p.nodes.next[u] != kNone || p.nodes.prev[v] != kNone) {
          ok = false;
          return;
        }
        p.nodes.next[u] = v;
        p.nodes.prev[v] = u;
      };
      if (a && b && !p.covered(x, y - 1)) side(x, y, x + 1, y);
      if (b && d && !p.covered(x + 1, y)) side(x + 1, y, x + 1, y + 1);
      if (d && c && !p.covered(x, y + 1)) side(x + 1, y + 1, x, y + 1);
      if (c && a && !p.covered(x - 1, y)) side(x, y + 1, x, y);
      if (!a)
        side(x, y + 1, x + 1, y);
      else if (!b)
        side(x, y, x + 1, y + 1);
      else if (!c)
        side(x + 1, y + 1, x, y);
      else if (!d)
        side(x + 1, y, x, y + 1);
      if (!ok) return RELIEF_ERROR_CORRUPT;
    }
  return RELIEF_OK;
}

// Every mask pixel must be in a triangle.
bool all_used(const Patch& p) {
  for (int y = 0; y < p.h; y++)
    for (int x = 0; x < p.w; x++)
      if (*p.at(x, y) && !p.covered(x, y) && !p.covered(x - 1, y) && !p.covered(x, y - 1) &&
          !p.covered(x - 1, y - 1))
        return false;
  return true;
}

}  // namespace

relief_status mesh_patch(const PatchHeader& patch, uint32_t patch_index, float spacing,
                         const Pyramid& pyramid, const uint8_t* mask, const float* z,
                         const MeshScratch& scratch, MeshWriter& mesh, Nodes& nodes, uint32_t& components) {
  const Band& b = pyramid.low[0];
  const Patch p = {patch,
                   patch_index,
                   int32_t(spacing),
                   int(b.width),
                   int(b.height),
                   mask + b.at(0, 0),
                   ptrdiff_t(b.stride),
                   scratch,
                   mesh,
                   nodes};
  if (!all_used(p)) return RELIEF_ERROR_CORRUPT;
  relief_status status = add_vertices(p, spacing, z);
  if (status != RELIEF_OK) return status;
  uint32_t runs = 0;
  status = add_triangles(p, runs);
  if (status != RELIEF_OK) return status;
  const uint32_t first = nodes.count;
  status = add_border(p);
  if (status != RELIEF_OK) return status;
  // number the pieces: run_of_cell is no longer needed and holds the new numbers
  uint32_t* number = scratch.run_of_cell;
  for (uint32_t r = 0; r < runs; r++) number[r] = kNone;
  for (uint32_t i = first; i < nodes.count; i++) {
    uint32_t& c = number[nodes.component[i]];
    if (c == kNone) c = components++;
    nodes.component[i] = c;
  }
  return RELIEF_OK;
}

}  // namespace relief
