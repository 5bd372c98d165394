// URIs of buffers and images: data URIs with base64, and relative paths with percent escapes.
#pragma once
#include <optional>
#include <string>

#include "gltf/files.h"

namespace relief {

// The bytes of a data URI; nothing if it is not one. Throws InputError if it is one but malformed.
std::optional<Bytes> decode_data_uri(const std::string& uri);
std::string encode_data_uri(const Bytes& bytes);

// The file that a relative URI names; throws InputError for URIs with a scheme or an absolute path.
std::filesystem::path resolve_uri(const std::filesystem::path& directory, const std::string& uri);

// A file name as a URI: everything but unreserved characters escaped.
std::string escape_uri(const std::string& name);

}  // namespace relief
