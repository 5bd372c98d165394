// Reading the triangles, or points, of a glTF scene; the part of surface/import.h that needs tinygltf.
#pragma once
#include <string>

#include "relief/encoder.h"

namespace relief {

// Reads all triangle primitives (modes 4, 5, 6) of the default scene of a .glb/.gltf, transformed to world
// space, as one mesh; primitives with RELIEF_patch_compression are decoded, to triangles also if they draw
// points. A scene without any is read as one point cloud of its primitives of points (mode 0). Normals are
// kept if every primitive has them, else left empty. Throws InputError as read_mesh does; also if there are
// neither triangles nor points.
TriangleMesh read_gltf_mesh(const std::string& path, const DecodeOptions& options = {});

}  // namespace relief
