// The triangles, or points, of a primitive of a glTF file.
#pragma once
#include "gltf/document.h"
#include "gltf/tinygltf_config.h"

namespace relief {

// tinygltf's model of the accessors, buffer views, meshes and nodes of a document. The indices of meshes,
// primitives, accessors and views are those of the document; buffers, images and extensions are left out.
tinygltf::Model geometry_model(const Document& document);

// Elements of the accessors that a primitive refers to, as the primitive's own space has them.
using Float3s = std::vector<std::array<float, 3>>;
Float3s read_float3(const Document& document, const tinygltf::Model& model, int accessor);

// The triangles or points of a primitive in its own space, without the vertices that none uses; decodes
// RELIEF_patch_compression, to the triangles of the surface even if the primitive draws its points. Throws
// InputError for primitives that cannot be read: other modes, Draco, meshopt.
TriangleMesh read_primitive(const Document& document, const tinygltf::Model& model, size_t mesh,
                            size_t primitive);

// "mesh 3 'statue' primitive 0"
std::string primitive_name(const Document& document, size_t mesh, size_t primitive);

// Does it draw triangles: mode 4, 5 or 6? Or points: mode 0?
bool is_triangles(const Json& primitive);
bool is_points(const Json& primitive);

// The extension that compresses a primitive or a buffer view of its accessors, other than ours; empty if
// none.
std::string foreign_codec(const Document& document, const Json& primitive);

}  // namespace relief
