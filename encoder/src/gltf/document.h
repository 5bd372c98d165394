// A glTF file as JSON and bytes: everything that the rest of the program does not know passes through
// unchanged.
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>

#include "gltf/files.h"

namespace relief {

using Json = nlohmann::ordered_json;  // keeps the order of the file

constexpr const char* kExtension = "RELIEF_patch_compression";

struct Document {
  Json json;
  std::vector<Bytes>
      buffers;  // one a buffer of the JSON; empty for placeholders without data (meshopt's fallback)
  std::filesystem::path directory;  // where relative URIs start
  DecodeOptions decoding;           // of the compressed primitives that are read
};

// Reads a .glb or .gltf with its buffers (chunk, data URIs, files) and checks the types and ranges of
// everything that refers to accessors, buffer views and buffers, so that the functions below need not.
Document load_document(const std::filesystem::path& path);

// Writes .glb (buffer 0 becomes the binary chunk) or .gltf (buffer 0 becomes a .bin of the same name next to
// it). Other buffers become data URIs. Images in files next to the input are embedded if the output is in
// another folder.
void save_document(Document document, const std::filesystem::path& out);

// The member of an object, or null if it is absent or this is not an object.
const Json* find(const Json& object, const char* key);
Json* find(Json& object, const char* key);

// The bytes [offset, offset + length) of a buffer view; throws InputError if they are not all there.
struct Span {
  const uint8_t* data = nullptr;
  size_t size = 0;
};
Span view_bytes(const Document& document, size_t view);

// The buffer view of a primitive's stream, or -1 if it is not compressed by us.
int64_t stream_view(const Json& primitive);

// Appends bytes to the first buffer with data (made if there is none) at a multiple of 4, and a buffer view
// for them; returns its index.
size_t append_view(Document& document, const Bytes& bytes);

// Adds an object to an array of the root (made if there is none); returns its index.
size_t append(Json& root, const char* array, Json object);

}  // namespace relief
