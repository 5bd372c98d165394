// Canonical meshing of a patch (4.2): four neighbouring pixels give two triangles, three give one.
#pragma once
#include "format.h"
#include "leaves.h"
#include "nodes.h"

namespace relief {

struct MeshWriter {
  float* positions;  // lattice coordinates (integers) until the very end
  uint32_t* indices;
  uint32_t vertex_capacity, triangle_capacity;
  uint32_t vertex_count, triangle_count;
};

// Covered cells side by side in a row that share their sides: union-find, and where the run ends.
struct Run {
  uint32_t parent, end;
};

struct MeshScratch {
  int32_t* height;      // pixels of a patch
  uint32_t* vertex;     // pixels of a patch
  Run* run;             // pixels of a patch
  uint32_t* first_run;  // rows of a patch
  uint8_t* cells;       // cell_bytes of a patch
  uint8_t* way;         // pixels of a patch: where the border goes on
};

// Bytes for the cells of a patch, with a row of none above, and for a row of flags.
constexpr uint64_t cell_bytes(uint64_t w, uint64_t h) { return 1 + w * (h + 2); }

// Adds the vertices and triangles of a patch to `mesh` and its border to `nodes`.
//   spacing  of the patch's grid at level 0
//   z        elevations, row by row, lattice units, without the patch's offset z0
//   mask     planes of the pyramid, of which low[level] is meshed
// Errors: CORRUPT if the mask is not clean (a pixel in no triangle, or one where the border touches itself),
// OUTPUT.
relief_status mesh_patch(const PatchHeader& patch, uint32_t patch_index, float spacing,
                         const Pyramid& pyramid, int level, const uint8_t* mask, const float* z,
                         const MeshScratch& scratch, MeshWriter& mesh, Nodes& nodes, uint32_t& components,
                         const Leaves& leaves);

}  // namespace relief
