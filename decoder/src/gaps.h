// Gap closing (4.2): triangles between the borders of patches; vertices stay where they are.
#pragma once
#include "mesh.h"
#include "nodes.h"
#include "tube.h"

namespace relief {

enum class LinkKind : uint8_t {
  kPlain,
  kDropped,  // the stream says that it is wrong
  kHandle,   // the stream says that it may make a handle
  kRefused,  // left out: would make a handle
  kIn,       // put in
  kMade,     // put in, and made a handle
};

// What the encoder wants to know of the faces between patches and of the links, to tell real holes from gaps
// and wrong links from right ones. Unused by the decoder.
struct GapTrace {
  uint32_t* first_triangle;  // of each face, in the order of faces
  uint32_t capacity, count;
  uint32_t (*links)[2];  // nodes of each link, in the order of links, before the seams change them
  LinkKind* kind;        // what became of each link
  uint32_t link_capacity, link_count;
  uint32_t* nodes;  // vertex of each
  uint32_t node_capacity, node_count;
  bool partners_known;  // `memory` holds what an earlier call found for the same nodes
};

// Builds without an encoder leave the tracing away.
#ifdef RELIEF_NO_TRACE
constexpr bool kTracing = false;
#else
constexpr bool kTracing = true;
#endif

struct GapOptions {
  int32_t spacing;  // the largest grid spacing, lattice units
  bool closed;      // close every face
  // The stream's last part, or null if it is missing or cut. Six lists, each of rising numbers as
  // differences (plus one) ended by zero: links to drop; links that may make a handle; nodes of links to add,
  // each followed by the distance to the other node; faces that stay open; triangles that a tube joins to
  // another, each followed by the distance to that one; triangles of gaps of which an edge is split by a
  // Steiner point, each followed by which one it is, and three times its height in zigzag. Empty lists at the
  // end are left away. Without seams, open faces are guessed by their size.
  const uint8_t* seams;
  const uint8_t* seams_end;
  GapTrace* trace;  // may be null
};

// Memory that close_gaps takes for n nodes.
struct GapMemory;
uint64_t gap_memory_bytes(uint32_t n);

// For n nodes there are at most this many tubes and Steiner points (part of the format), and with them so
// many vertices and triangles are added: faces have at most 5 n corners, each with a vertex and three
// triangles, and each face of at least three with one vertex more.
constexpr uint64_t most_tubes(uint64_t n) { return n / 32; }
constexpr uint64_t most_steiner_points(uint64_t n) { return n / 8; }
// Also part of the format: of the triangles at a Steiner point's edge the second is one of so many after the
// first; its height is in so many parts of the edge's length, from minus so many to so many less one.
constexpr uint32_t kSteinerWindow = 256;
constexpr int32_t kSteinerParts = 8, kSteinerHeights = 128;
constexpr uint64_t gap_vertices(uint64_t n) { return 7 * n; }
constexpr uint64_t gap_triangles(uint64_t n) {
  return 15 * n + kTubeTriangles * most_tubes(n) + 2 * most_steiner_points(n);
}

// Adds the triangles to `mesh`. memory: gap_memory_bytes(nodes.count) bytes, aligned to 16.
// However the nodes lie, the result is an oriented 2-manifold: the faces come from a rotation system (see
// gap_links.cpp), which has no other kind of surface, and no edge is made twice; tubes keep it one.
// Errors: OUTPUT; CORRUPT if the seams are malformed.
relief_status close_gaps(const Nodes& nodes, uint32_t components, const GapOptions& options, MeshWriter& mesh,
                         void* memory);

}  // namespace relief
