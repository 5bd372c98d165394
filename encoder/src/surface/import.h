// Reading surfaces from files and writing them.
#pragma once
#include <string>

#include "relief/encoder.h"

namespace relief {

// Reads .ply (ascii, both binary orders), .obj, .off, .stl (ascii, binary), and .glb / .gltf (all triangle
// primitives of the default scene, transformed to world space; primitives with RELIEF_patch_compression are
// decoded). Polygons are split into triangles by fans. Point clouds, meshes without triangles, come from .ply
// without faces, .xyz, .pcd, and .glb / .gltf with primitives of points only. Throws InputError: missing
// file, unknown format, no vertices, no faces, NaN or infinite coordinates (with the vertex' number), indices
// out of range (with the face's number), truncation.
TriangleMesh read_mesh(const std::string& path, const DecodeOptions& options = {});

// Writes .ply (binary little endian), .obj, .glb (plain, uncompressed) by extension, of point clouds .ply and
// .xyz; to a temporary name, then renamed.
void write_mesh(const std::string& path, const TriangleMesh& mesh);

// Likewise a point cloud: .ply, .obj, .xyz.
void write_points(const std::string& path, const TriangleMesh& mesh);

}  // namespace relief
