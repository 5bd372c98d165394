// Gap closing (4.2): triangles between the borders of patches; vertices stay where they are.
#pragma once
#include "mesh.h"
#include "nodes.h"

namespace relief {

// What the encoder wants to know of the faces between patches, to tell real holes from gaps. Unused by the decoder.
struct GapTrace {
  uint32_t* first_triangle;  // of each face, in the order of faces
  uint32_t capacity, count;
};

struct GapOptions {
  int32_t spacing;        // the largest grid spacing, lattice units
  bool closed;            // close every face
  const uint8_t* holes;   // the stream's list of faces that stay open (null: not known, guess by size)
  const uint8_t* holes_end;
  GapTrace* trace;        // may be null
};

// Memory that close_gaps takes for n nodes.
struct GapMemory;
uint64_t gap_memory_bytes(uint32_t n);

// At most this many vertices and triangles are added for n nodes.
constexpr uint64_t gap_vertices(uint64_t n) { return 5 * n; }
constexpr uint64_t gap_triangles(uint64_t n) { return 15 * n; }

// Adds the triangles to `mesh`. memory: gap_memory_bytes(nodes.count) bytes, aligned to 16.
// However the nodes lie, the result is an oriented 2-manifold: the faces come from a rotation system (the cyclic order
// of links around each node), which has no other kind of surface, and no edge is made twice.
// Errors: OUTPUT; CORRUPT if the list of holes is malformed.
relief_status close_gaps(const Nodes& nodes, uint32_t components, const GapOptions& options, MeshWriter& mesh,
                         void* memory);

}  // namespace relief
