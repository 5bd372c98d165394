#include "mesh.h"

#include <string.h>

#include "diagonal.h"
#include "runs.h"

namespace relief {
namespace {

struct Patch {
  const PatchHeader& header;
  uint32_t index;
  int32_t spacing;
  int level;
  int w, h;
  const uint8_t* mask;  // pixel (0, 0)
  ptrdiff_t stride;
  const MeshScratch& s;
  MeshWriter& mesh;
  Nodes& nodes;
  const Leaves& leaves;

  const uint8_t* at(int x, int y) const { return mask + y * stride + x; }
  size_t pixel(int x, int y) const { return size_t(y) * size_t(w) + size_t(x); }

  // Cell (x, y) has its pixels at (x, y) .. (x+1, y+1); covered if at least three are in the mask. The number
  // of those, or 0. The last cell of a row, which is none, stands before the first of the next row as well.
  uint8_t* cells(int y) const { return s.cells + 1 + ptrdiff_t(w) * (y + 1); }
  bool covered(int x, int y) const { return cells(y)[x] != 0; }
  // A row of flags, behind the cells.
  uint8_t* flags() const { return cells(h); }
};

// Finds the cells. Every mask pixel must be in a triangle.
bool find_cells(const Patch& p) {
  memset(p.s.cells, 0, size_t(p.w) + 1);
  memset(p.cells(p.h - 1), 0, size_t(p.w));
  for (int y = 0; y + 1 < p.h; y++) {
    p.leaves.count_cells(p.at(0, y), p.stride, p.cells(y), uint32_t(p.w - 1));
    p.cells(y)[p.w - 1] = 0;
  }
  bool stray = false;
  for (int y = 0; y < p.h; y++) stray |= p.leaves.any_stray(p.at(0, y), p.cells(y), p.w, uint32_t(p.w));
  return !stray;
}

relief_status add_vertices(const Patch& p, float spacing, const float* z) {
  const Frame f = frame_of(p.header.u, p.header.v);
  float b[3], o[3];
  RowFrame row;
  const float offset = float(p.header.z0) * spacing;
  for (int i = 0; i < 3; i++) {
    row.along[i] = float(f.e1[i]) * spacing;
    b[i] = float(f.e2[i]) * spacing;
    row.normal[i] = float(f.n[i]);
    o[i] = row.normal[i] * offset;
  }
  row.level = p.level;
  MeshWriter& mesh = p.mesh;
  p.leaves.heights(z, p.s.height, uint32_t(p.pixel(0, p.h)));
  for (int y = 0; y < p.h; y++) {
    const float fy = float(p.header.y0 + (y << p.level));
    for (int i = 0; i < 3; i++) row.origin[i] = o[i] + fy * b[i];
    const uint8_t* m = p.at(0, y);
    for (int begin = run_end(m, 0, p.w, 0), x; begin < p.w; begin = run_end(m, x, p.w, 0)) {
      x = run_end(m, begin, p.w, 1);
      const uint32_t n = uint32_t(x - begin), first = mesh.vertex_count;
      if (mesh.vertex_capacity - first < n) return RELIEF_ERROR_OUTPUT;
      const size_t i = p.pixel(begin, y);
      p.leaves.place_row(row, p.header.x0 + (begin << p.level), z + i, mesh.positions + 3 * size_t(first), n);
      for (uint32_t k = 0; k < n; k++) p.s.vertex[i + k] = first + k;
      mesh.vertex_count += n;
    }
  }
  return RELIEF_OK;
}

uint32_t find(Run* run, uint32_t i) {
  while (run[i].parent != i) i = run[i].parent = run[run[i].parent].parent;
  return i;
}

// Two triangles for each of n full cells side by side, a and c their first vertices above and below.
void write_quads(uint32_t* out, uint32_t a, uint32_t c, const uint8_t* main, int n) {
  for (int i = 0; i < n; i++, a++, c++, out += 6) {
    const uint32_t m = main[i];
    out[0] = a, out[1] = a + 1, out[2] = c + m;
    out[3] = a + 1 - m, out[4] = c + 1, out[5] = c;
  }
}

// The triangle of a cell with a pixel missing.
void write_triangle(uint32_t* out, const uint8_t* m, ptrdiff_t stride, const uint32_t* v, int w) {
  const uint32_t a = v[0], b = v[1], c = v[w], d = v[w + 1];
  out[0] = m[0] ? a : b;
  out[1] = m[0] && m[1] ? b : d;
  out[2] = m[0] && m[1] && !m[stride] ? d : c;
}

// Joins the last run, of which these are n cells from (x, y) on, with those above that share a side. above:
// the run above to go on from
void join_runs(const Patch& p, int x, int y, int n, uint32_t last, uint32_t& above) {
  const uint8_t *cells = p.cells(y - 1), *m = p.at(0, y);
  Run* const run = p.s.run;
  for (const int end = x + n; x < end;) {
    if (!cells[x]) {
      x = run_end(cells, x, end, 0);
      continue;
    }
    while (int(run[above].end) <= x) above++;
    if (m[x] && m[x + 1]) {
      run[find(run, last)].parent = find(run, above);
      x = int(run[above].end);
    } else {
      x++;
    }
  }
}

// Triangles of all cells; runs of cells that share a side are joined to connected pieces of the patch.
relief_status add_triangles(const Patch& p, uint32_t& runs) {
  MeshWriter& mesh = p.mesh;
  uint8_t* const main = p.flags();
  runs = 0;
  for (int y = 0; y + 1 < p.h; y++) {
    const uint8_t *cells = p.cells(y), *m = p.at(0, y);
    memset(main, 1, size_t(p.w));  // at the ends of the grid there is no prediction
    if (y > 0 && y + 2 < p.h && p.w > 3)
      p.leaves.diagonals(p.s.height + p.pixel(1, y), p.w, m + 1, p.stride, main + 1, uint32_t(p.w - 3));
    uint32_t above = y > 0 ? p.s.first_run[y - 1] : 0;
    p.s.first_run[y] = runs;
    bool open = false;  // the cell to the left is covered and shares its right side
    for (int x = 0; x + 1 < p.w;) {
      const int begin = x, count = cells[x];
      x = count == 3 ? x + 1 : run_end(cells, x, p.w - 1, uint8_t(count));
      if (count == 0) {
        open = false;
        continue;
      }
      const uint32_t* v = p.s.vertex + p.pixel(begin, y);
      const int n = x - begin;
      const uint32_t triangles = uint32_t((count - 2) * n);
      if (mesh.triangle_capacity - mesh.triangle_count < triangles) return RELIEF_ERROR_OUTPUT;
      uint32_t* out = mesh.indices + 3 * size_t(mesh.triangle_count);
      if (count == 4)
        write_quads(out, v[0], v[p.w], main + begin, n);
      else
        write_triangle(out, m + begin, p.stride, v, p.w);
      mesh.triangle_count += triangles;
      if (!open) p.s.run[runs] = {runs, 0}, runs++;
      p.s.run[runs - 1].end = uint32_t(x);
      if (y > 0) join_runs(p, begin, y, n, runs - 1, above);
      open = m[x] && m[x + p.stride];
    }
  }
  return RELIEF_OK;
}

// The neighbours of a pixel, counter-clockwise: the directions of the border's chain code (Freeman 1961).
constexpr int8_t kRing[8][2] = {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}};
constexpr uint8_t kNoWay = 0xff;

// The sides of a cell with no covered cell across, counter-clockwise. False if the border touches itself
// there.
bool add_sides(const Patch& p, int x, int y) {
  const uint8_t* m = p.at(x, y);
  const bool a = m[0], b = m[1], c = m[p.stride], d = m[p.stride + 1];
  bool ok = true;
  auto side = [&](int from_x, int from_y, uint8_t way) {
    uint8_t& from = p.s.way[p.pixel(from_x, from_y)];
    ok = ok && from == kNoWay;
    from = way;
  };
  if (a && b && !p.covered(x, y - 1)) side(x, y, 0);
  if (b && d && !p.covered(x + 1, y)) side(x + 1, y, 2);
  if (d && c && !p.covered(x, y + 1)) side(x + 1, y + 1, 4);
  if (c && a && !p.covered(x - 1, y)) side(x, y + 1, 6);
  if (!a)
    side(x, y + 1, 7);
  else if (!b)
    side(x, y, 1);
  else if (!c)
    side(x + 1, y + 1, 5);
  else if (!d)
    side(x + 1, y, 3);
  return ok;
}

// Sides of covered cells with no covered cell across become the border, the patch on the left. As many sides
// leave a pixel as arrive there: if not more than one does, the border is loops.
bool find_border(const Patch& p) {
  uint8_t* const border = p.flags();
  memset(p.s.way, kNoWay, p.pixel(0, p.h));
  bool ok = true;
  for (int y = 0; y + 1 < p.h; y++) {
    p.leaves.border_cells(p.cells(y), p.w, border, uint32_t(p.w - 1));
    for (int x = run_end(border, 0, p.w - 1, 0); x + 1 < p.w; x = run_end(border, x + 1, p.w - 1, 0))
      ok = add_sides(p, x, y) && ok;
  }
  return ok;
}

// Normal at a border pixel: the sum over the triangles between it and its neighbours in covered cells.
//
// In a cell with the neighbours a, b and c around it (relative to it), counter-clockwise, these are a x b + b
// x c = (a - c) x b, where a missing a or c is zero, or, b missing, a x c = (a - c) x a. Of a cell that is
// not covered, with two neighbours missing, that is zero.
void node_normal(const Patch& p, int x, int y, int16_t out[3]) {
  const size_t here = p.pixel(x, y);
  const float* const centre = p.mesh.positions + 3 * size_t(p.s.vertex[here]);
  int32_t ring[8][3];
  bool in[8];
  for (int k = 0; k < 8; k++) {
    const int dx = kRing[k][0], dy = kRing[k][1];
    in[k] = *p.at(x + dx, y + dy);
    const size_t there = in[k] ? here + size_t(ptrdiff_t(dy) * p.w + dx) : here;
    const float* const v = p.mesh.positions + 3 * size_t(p.s.vertex[there]);
    for (int i = 0; i < 3; i++) ring[k][i] = int32_t(v[i] - centre[i]);
  }
  int64_t sum[3] = {0, 0, 0};
  for (int k = 0; k < 8; k += 2) {
    const int32_t *a = ring[k], *c = ring[(k + 2) % 8], *b = in[k + 1] ? ring[k + 1] : a;
    const int64_t ac[3] = {a[0] - c[0], a[1] - c[1], a[2] - c[2]}, to[3] = {b[0], b[1], b[2]};
    int64_t n[3];
    cross(ac, to, n);
    for (int i = 0; i < 3; i++) sum[i] += n[i];
  }
  unit_vector(sum, out);
}

// In the surface, out of the patch: tangent of the border x normal.
void find_outward(const Nodes& nodes, Node& n) {
  int64_t t[3], c[3];
  difference(nodes[n.prev], nodes[n.next], t);
  const int64_t normal[3] = {n.normal[0], n.normal[1], n.normal[2]};
  cross(t, normal, c);
  unit_vector(c, n.outward);
}

// The run of a covered cell that a pixel is a corner of.
uint32_t run_at(const Patch& p, int x, int y) {
  const int left = p.covered(x - 1, y - 1) || p.covered(x - 1, y), above = p.covered(x - left, y - 1);
  uint32_t run = p.s.first_run[y - above];
  while (int(p.s.run[run].end) <= x - left) run++;
  return find(p.s.run, run);
}

// Makes the nodes of the loop through a pixel, one after the other along the border. False if there is no
// room.
bool add_loop(const Patch& p, int x, int y) {
  Nodes& n = p.nodes;
  const uint32_t first = n.count, run = run_at(p, x, y);
  for (uint8_t way; (way = p.s.way[p.pixel(x, y)]) != kNoWay; x += kRing[way][0], y += kRing[way][1]) {
    if (n.count == n.capacity) return false;
    Node& node = n[n.count];
    node.vertex = p.s.vertex[p.pixel(x, y)];
    for (int k = 0; k < 3; k++) node.position[k] = int32_t(p.mesh.positions[3 * size_t(node.vertex) + k]);
    node_normal(p, x, y, node.normal);
    node.next = n.count + 1;
    node.prev = n.count - 1;
    node.loop = n.loop_count;
    node.place = n.count - first;
    node.patch = p.index;
    node.pixel[0] = uint16_t(x);
    node.pixel[1] = uint16_t(y);
    node.spacing = p.spacing;
    node.component = run;
    p.s.way[p.pixel(x, y)] = kNoWay;
    n.count++;
  }
  n[n.count - 1].next = first;
  n[first].prev = n.count - 1;
  for (uint32_t i = first; i < n.count; i++) find_outward(n, n[i]);
  n.loop_length[n.loop_count++] = n.count - first;
  return true;
}

// Loops begin where they are met first, row by row.
bool add_nodes(const Patch& p) {
  for (int y = 0; y < p.h; y++) {
    const uint8_t* const row = p.s.way + p.pixel(0, y);
    for (int x = run_end(row, 0, p.w, kNoWay); x < p.w; x = run_end(row, x + 1, p.w, kNoWay))
      if (!add_loop(p, x, y)) return false;
  }
  return true;
}

}  // namespace

relief_status mesh_patch(const PatchHeader& patch, uint32_t patch_index, float spacing,
                         const Pyramid& pyramid, int level, const uint8_t* mask, const float* z,
                         const MeshScratch& scratch, MeshWriter& mesh, Nodes& nodes, uint32_t& components,
                         const Leaves& leaves) {
  const Band& b = pyramid.low[level];
  const Patch p = {patch,
                   patch_index,
                   int32_t(spacing * float(1 << level)),
                   level,
                   int(b.width),
                   int(b.height),
                   mask + b.at(0, 0),
                   ptrdiff_t(b.stride),
                   scratch,
                   mesh,
                   nodes,
                   leaves};
  if (!find_cells(p)) return RELIEF_ERROR_CORRUPT;
  relief_status status = add_vertices(p, spacing, z);
  if (status != RELIEF_OK) return status;
  uint32_t runs = 0;
  status = add_triangles(p, runs);
  if (status != RELIEF_OK) return status;
  const uint32_t first = nodes.count;
  if (!find_border(p) || !add_nodes(p)) return RELIEF_ERROR_CORRUPT;
  // number the pieces: where runs end is no longer needed
  for (uint32_t r = 0; r < runs; r++) scratch.run[r].end = kNone;
  for (uint32_t i = first; i < nodes.count; i++) {
    uint32_t& c = scratch.run[nodes[i].component].end;
    if (c == kNone) c = components++;
    nodes[i].component = c;
  }
  return RELIEF_OK;
}

}  // namespace relief
