// The working state of gap closing (4.2), shared by its steps: gap_partners, gap_links, gap_faces,
// triangulation, tube, steiner_points.
#pragma once
#include "container.h"
#include "gaps.h"

namespace relief {

constexpr uint32_t kMaxDegree = 16;  // links at a node
constexpr uint32_t kBigFace = 12;    // corners beyond which a face may be a hole when the stream does not say

struct Link {
  uint32_t node[2], slot[2];  // both ends
  uint8_t rank;  // by length, the shortest first
  LinkKind kind;
};

struct Slot {     // one end of a link, at a node
  uint32_t to;    // the other node
  uint32_t twin;  // the slot there
  uint32_t link;
};

// A place on a face's rim where it leaves a node: number v leaves node v along the border, backwards, and
// number count + s by the link of slot s. Rims are lists.
struct Corner {
  uint32_t next;  // or kNone while the link is not put in
  uint32_t face;  // while faces are closed: its node, kNone once its face is closed
};

struct Diagonal {
  uint32_t to, next;
};

// A node in the order of the cells of the search grid.
struct CellNode {
  int32_t position[3];
  uint32_t node;
};

// One of the lists of the seams: rising numbers as differences, ended by zero or by the end of the bytes.
struct NumberList {
  const uint8_t *p, *end;
  uint32_t next = 0;  // the next number, plus one; 0: no more
  bool good = true;
  uint32_t varint() {
    uint32_t value = 0;
    if (p == end || !good) return 0;
    if (!read_varint(p, end, value)) good = false;
    return good ? value : 0;
  }
  void advance() {
    const uint32_t d = varint();
    if (d > 0xffffffffu - next) good = false;
    next = good && d ? next + d : 0;
  }
};

struct Gaps {
  const Nodes& n;
  const GapOptions& options;
  MeshWriter& mesh;
  uint32_t count, components;
  // by node
  uint32_t *slot_begin, *diagonals, *mark;
  uint32_t* next;     // that of the nodes, closer together
  int32_t* distance;  // to the nearest
  uint8_t* open_corner;
  uint32_t* cell_begin;
  CellNode* cell_nodes;
  uint32_t bucket_mask;
  int cell_shift;
  int rank_shift;         // of lengths: ranks are a sixteenth to an eighth of the largest spacing apart
  uint32_t* group;        // union-find over components
  Link* links;
  uint32_t* by_rank;  // numbers of links
  uint32_t link_count, link_capacity;
  Slot* slots;
  Corner* corner;
  Diagonal* diagonal;
  uint32_t diagonal_count, diagonal_capacity;
  uint32_t* face;  // corners of the face at hand
  uint32_t face_count, corner_capacity, mark_count;
  NumberList seams;
  int64_t work;  // steps of walking left; only hostile streams need so many

  Gaps(const Nodes& nodes, const GapOptions& o, MeshWriter& m)
      : n(nodes), options(o), mesh(m), seams{o.seams, o.seams_end} {}

  uint32_t find(uint32_t i) const {  // union-find with path halving
    while (group[i] != i) i = group[i] = group[group[i]];
    return i;
  }
  void unite(uint32_t a, uint32_t b) { group[find(a)] = find(b); }
  uint32_t corner_of(uint32_t slot) const { return count + slot; }
  bool is_in(uint32_t slot) const { return corner[corner_of(slot)].next != kNone; }
};

inline int64_t distance2(const Node& a, const Node& b) {
  int64_t d[3];
  difference(a, b, d);
  return d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
}
inline int64_t dot(const int64_t a[3], const int16_t b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline int32_t dot(const int16_t a[3], const int16_t b[3]) {
  return int32_t(a[0]) * b[0] + int32_t(a[1]) * b[1] + int32_t(a[2]) * b[2];
}
inline int64_t root(int64_t v) { return int64_t(__builtin_sqrt(double(v))); }  // v < 2^53: exact argument

inline int64_t clamp_coordinate(int64_t v) {
  return v > kCoordinateLimit ? kCoordinateLimit : v < -kCoordinateLimit ? -kCoordinateLimit : v;
}

// For every node the nearest one that faces it over a gap, in g.nearest.
void find_partners(Gaps& g);

// Puts the links in. False if the seams are malformed.
bool make_links(Gaps& g);

// Adds the triangles of all faces. Leaves g.seams at the end of their list.
relief_status close_faces(Gaps& g);

// Joins triangles of patches, the first so many of the mesh, by the tubes that the rest of the seams tells
// of.
relief_status add_tubes(Gaps& g, uint32_t patch_triangles);

// Adds the Steiner points that the rest of the seams tells of to triangles [first, end), those of gaps.
relief_status add_steiner_points(Gaps& g, uint32_t first, uint32_t end);

}  // namespace relief
