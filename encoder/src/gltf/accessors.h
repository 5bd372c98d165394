// The accessors of primitives that we write.
#pragma once
#include "gltf/document.h"

namespace relief {

// Accessors without data, as a compressed primitive has them: counts, types, and the bounds of the positions.
Json position_accessor(const TriangleMesh& mesh);
Json normal_accessor(const TriangleMesh& mesh);
Json color_accessor(const TriangleMesh& mesh);  // 16 bits: what 8 bits of sRGB are as linear colours
Json index_accessor(const TriangleMesh& mesh);

// Their data, little-endian.
Bytes position_bytes(const TriangleMesh& mesh);
Bytes normal_bytes(const TriangleMesh& mesh);
Bytes color_bytes(const TriangleMesh& mesh);
Bytes index_bytes(const TriangleMesh& mesh);

// A buffer view for data of an accessor, with the target that the data is for; returns its index.
constexpr unsigned kArrayBuffer = 34962, kElementArrayBuffer = 34963;
size_t append_vertex_view(Document& document, const Bytes& bytes, unsigned target);

// An empty scene of one node with one mesh of one primitive.
Document one_primitive_document();

// Adds or removes a name in extensionsUsed or extensionsRequired.
void add_name(Json& root, const char* list, const char* name);
void remove_name(Json& root, const char* list, const char* name);

}  // namespace relief
