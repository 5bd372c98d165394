#include "gltf/document.h"

#include <algorithm>
#include <cstring>

#include "gltf/check.h"
#include "gltf/references.h"
#include "gltf/uri.h"

namespace relief {

namespace fs = std::filesystem;

namespace {

// The binary container, glTF 2.0 section 4.4: a header of 12 bytes, then chunks of length, type and data.
constexpr uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

uint32_t get32(const uint8_t* p) { return p[0] | p[1] << 8 | p[2] << 16 | uint32_t(p[3]) << 24; }

void put32(Bytes& out, uint32_t v) {
  for (int k = 0; k < 4; k++) out.push_back(uint8_t(v >> (8 * k)));
}

struct Chunks {
  Span json, binary;
  bool has_binary = false;
};

Chunks split_glb(const Bytes& file) {
  if (file.size() < 20) throw InputError("is truncated: too short for a GLB header");
  if (get32(&file[0]) != kMagic) throw InputError("is not a GLB file");
  if (get32(&file[4]) != 2) throw InputError("is GLB version " + std::to_string(get32(&file[4])) + ", not 2");
  size_t length = get32(&file[8]);
  if (length > file.size()) throw InputError("is truncated: shorter than the length in its header");
  Chunks chunks;
  size_t at = 12;
  if (length < at) throw InputError("is truncated: the length in its header is less than the header's");
  for (int i = 0; length - at >= 8; i++) {
    size_t size = get32(&file[at]);
    uint32_t type = get32(&file[at + 4]);
    at += 8;
    if (size > length - at) throw InputError("GLB chunk " + std::to_string(i) + " is longer than the file");
    if ((type == kJsonChunk) != (i == 0)) throw InputError("GLB does not begin with one JSON chunk");
    if (i == 0) chunks.json = {&file[0] + at, size};
    if (i == 1 && type == kBinaryChunk) {
      chunks.binary = {&file[0] + at, size};
      chunks.has_binary = true;
    }
    at += size;
  }
  if (!chunks.json.data) throw InputError("GLB has no JSON chunk");
  return chunks;
}

// Nested deeper than any glTF file, so that recursion over the JSON cannot exhaust the stack.
constexpr int kMaxNesting = 200;

void check_nesting(const Span& text) {
  int depth = 0;
  bool quoted = false;
  for (size_t i = 0; i < text.size; i++) {
    uint8_t c = text.data[i];
    if (quoted && c == '\\') i++;
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    if (c == '{' || c == '[') depth++;
    if (c == '}' || c == ']') depth--;
    if (depth > kMaxNesting) throw InputError("JSON is nested too deeply");
  }
}

Json parse_json(const Span& text) {
  check_nesting(text);
  try {
    return Json::parse(text.data, text.data + text.size);
  } catch (const Json::exception& e) {
    std::string what = e.what();  // "[json.exception.parse_error.101] parse error at line 1, column 2: ..."
    what = what.substr(std::min(what.size(), what.find("] ") + 2));
    std::replace(what.begin(), what.end(), '\n', ' ');
    throw InputError("is not valid JSON: " + what.substr(0, 200));
  }
}

Bytes load_buffer(const Json& buffer, size_t i, const fs::path& directory, const Chunks& chunks) {
  std::string name = "buffer " + std::to_string(i);
  size_t length = buffer.at("byteLength").get<size_t>();
  if (length == 0) return {};
  Bytes bytes;
  if (const Json* uri = find(buffer, "uri")) {
    const std::string& text = uri->get_ref<const std::string&>();
    if (auto data = decode_data_uri(text))
      bytes = std::move(*data);
    else
      bytes = read_file(resolve_uri(directory, text));
  } else if (i == 0 && chunks.has_binary) {
    bytes.assign(chunks.binary.data, chunks.binary.data + std::min(chunks.binary.size, length));
  } else {
    return {};  // a placeholder: meshopt's fallback, or bytes that the application was to provide
  }
  if (bytes.size() < length)
    throw InputError(name + " is truncated: " + std::to_string(bytes.size()) + " of " +
                     std::to_string(length) + " bytes");
  bytes.resize(length);
  return bytes;
}

}  // namespace

Document load_document(const fs::path& path) {
  Document document;
  document.directory = path.parent_path();
  Bytes file = read_file(path);
  bool binary = file.size() >= 4 && get32(&file[0]) == kMagic;
  if (!binary && lower_extension(path) == ".glb") split_glb(file);  // says what is wrong
  Chunks chunks;
  if (binary)
    chunks = split_glb(file);
  else
    chunks.json = {file.data(), file.size()};
  document.json = parse_json(chunks.json);
  check_json(document.json);
  if (const Json* buffers = find(document.json, "buffers"))
    for (size_t i = 0; i < buffers->size(); i++)
      document.buffers.push_back(load_buffer((*buffers)[i], i, document.directory, chunks));
  return document;
}

const Json* find(const Json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  auto it = object.find(key);
  return it == object.end() ? nullptr : &*it;
}

Json* find(Json& object, const char* key) {
  return const_cast<Json*>(find(static_cast<const Json&>(object), key));
}

Span view_bytes(const Document& document, size_t view) {
  const Json& v = document.json.at("bufferViews").at(view);
  size_t b = v.at("buffer").get<size_t>();
  const Bytes& buffer = document.buffers.at(b);
  if (buffer.empty()) throw InputError("buffer " + std::to_string(b) + " has no data");
  uint64_t offset = v.value("byteOffset", uint64_t(0)), length = v.at("byteLength").get<uint64_t>();
  if (offset > buffer.size() || length > buffer.size() - offset)
    throw InputError("buffer view " + std::to_string(view) + " exceeds its buffer");
  return {buffer.data() + offset, size_t(length)};
}

int64_t stream_view(const Json& primitive) {
  const Json* extensions = find(primitive, "extensions");
  const Json* ours = extensions ? find(*extensions, kExtension) : nullptr;
  return ours ? ours->at("bufferView").get<int64_t>() : -1;
}

size_t append(Json& root, const char* array, Json object) {
  if (!find(root, array)) root[array] = Json::array();
  root[array].push_back(std::move(object));
  return root[array].size() - 1;
}

size_t append_view(Document& document, const Bytes& bytes) {
  size_t b = 0;
  while (b < document.buffers.size() && document.buffers[b].empty()) b++;
  if (b == document.buffers.size()) {
    append(document.json, "buffers", {{"byteLength", 0u}});
    document.buffers.emplace_back();
  }
  Bytes& buffer = document.buffers[b];
  buffer.resize((buffer.size() + 3) / 4 * 4);
  Json view = {{"buffer", b}, {"byteOffset", buffer.size()}, {"byteLength", bytes.size()}};
  buffer.insert(buffer.end(), bytes.begin(), bytes.end());
  document.json["buffers"][b]["byteLength"] = buffer.size();
  return append(document.json, "bufferViews", std::move(view));
}

// --- Writing
// -------------------------------------------------------------------------------------------------------

namespace {

// The MIME type by the first bytes, or null.
const char* image_type(const Bytes& bytes) {
  auto has = [&](size_t at, const char* magic) {
    size_t n = std::strlen(magic);
    return bytes.size() >= at + n && std::memcmp(bytes.data() + at, magic, n) == 0;
  };
  if (has(0, "\x89PNG")) return "image/png";
  if (has(0, "\xff\xd8\xff")) return "image/jpeg";
  if (has(0, "\xabKTX 20")) return "image/ktx2";
  return has(8, "WEBP") ? "image/webp" : nullptr;
}

// The bytes of an image with a URI, if they are to move into the buffer: those of data URIs, which a GLB
// should not hold, and those of files beside the input, which would be lost in another folder. Else nothing.
Bytes movable_image(const Document& document, const Json& image, bool data_uris, bool files) {
  const Json* uri = find(image, "uri");
  if (!uri || !uri->is_string()) return {};
  const std::string& text = uri->get_ref<const std::string&>();
  bool is_data = text.rfind("data:", 0) == 0;
  if (is_data ? !data_uris : !files) return {};
  try {
    return is_data ? *decode_data_uri(text) : read_file(resolve_uri(document.directory, text));
  } catch (const InputError&) {
    return {};  // it was missing or malformed before as well
  }
}

void embed_images(Document& document, bool data_uris, bool files) {
  size_t count = document.json.contains("images") ? document.json["images"].size() : 0;
  for (size_t i = 0; i < count; i++) {
    Bytes bytes = movable_image(document, document.json["images"][i], data_uris, files);
    const char* type = image_type(bytes);
    if (!type) continue;
    size_t view = append_view(document, bytes);
    Json& image = document.json["images"][i];
    image.erase("uri");
    image["mimeType"] = type;
    image["bufferView"] = view;
  }
}

void write_glb(Document& document, const fs::path& out) {
  std::string text = document.json.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  bool has_data = !document.buffers.empty() && !document.buffers[0].empty();
  if (!has_data && !document.buffers.empty() && document.json["buffers"][0]["byteLength"] != 0u)
    throw InputError("buffer 0 has no data for the GLB's binary chunk");
  Bytes none, &binary = has_data ? document.buffers[0] : none;
  binary.resize((binary.size() + 3) / 4 * 4);
  uint64_t length = 12 + 8 + text.size() + (has_data ? 8 + binary.size() : 0);
  if (length > UINT32_MAX)
    throw FileError(out, "would be larger than the 4 GiB of a GLB; write a .gltf instead");
  Bytes head, binary_head;
  for (uint32_t word : {kMagic, 2u, uint32_t(length), uint32_t(text.size()), kJsonChunk}) put32(head, word);
  head.insert(head.end(), text.begin(), text.end());
  if (has_data)
    for (uint32_t word : {uint32_t(binary.size()), kBinaryChunk}) put32(binary_head, word);
  write_files({{out, {&head, &binary_head, &binary}}});
}

void write_gltf(Document& document, const fs::path& out) {
  std::vector<OutputFile> files;
  if (!document.buffers.empty() && !document.buffers[0].empty()) {
    fs::path bin = out;
    bin.replace_extension(".bin");
    document.json["buffers"][0]["uri"] = escape_uri(bin.filename().string());
    files.push_back({bin, {&document.buffers[0]}});
  }
  std::string text = document.json.dump(2) + "\n";
  Bytes bytes(text.begin(), text.end());
  files.push_back({out, {&bytes}});
  write_files(files);
}

bool same_folder(const fs::path& a, const fs::path& b) {
  std::error_code error;
  return fs::equivalent(a.empty() ? "." : a, b.empty() ? "." : b, error);
}

}  // namespace

void save_document(Document document, const fs::path& out) {
  std::string extension = lower_extension(out);
  if (extension != ".glb" && extension != ".gltf") throw FileError(out, "is neither .glb nor .gltf");
  embed_images(document, extension == ".glb", !same_folder(document.directory, out.parent_path()));
  for (size_t i = 0; i < document.buffers.size(); i++) {
    Json& buffer = document.json["buffers"][i];
    if (i > 0 && !document.buffers[i].empty()) buffer["uri"] = encode_data_uri(document.buffers[i]);
    if (i == 0) buffer.erase("uri");
  }
  if (extension == ".glb")
    write_glb(document, out);
  else
    write_gltf(document, out);
}

}  // namespace relief
