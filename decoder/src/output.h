// What a decode leaves behind, in the form that the caller asked for.
#pragma once
#include "format.h"
#include "leaves.h"
#include "mesh.h"

namespace relief {

// Builds that write floats and 32-bit indices only, tightly packed, leave the other forms away, and
// smoothing.
#ifdef RELIEF_PLAIN
constexpr bool kPlain = true;
#else
constexpr bool kPlain = false;
#endif

// Whether an array is written as it is made, in the caller's memory.
inline bool float_positions(const relief_options& o) {
  return kPlain || (!(o.flags & RELIEF_QUANTISED) && o.position_stride == sizeof(float[3]));
}
inline bool float_normals(const relief_options& o) {
  return kPlain || (!(o.flags & RELIEF_QUANTISED) && o.normal_stride == sizeof(float[3]));
}
inline bool wide_indices(const relief_options& o) { return kPlain || !(o.flags & RELIEF_INDICES_16); }

// Puts the mesh from the lattice into the model's units, finds its bounds, and writes what is not in place.
//   normals   of unit length, or null
// Errors: OUTPUT if there are more vertices than indices can tell.
relief_status write_output(const relief_options& options, const StreamHeader& header, const MeshWriter& mesh,
                           const float* normals, relief_mesh& out, const Leaves& leaves);

}  // namespace relief
