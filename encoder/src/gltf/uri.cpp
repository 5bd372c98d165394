#include "gltf/uri.h"

#include <algorithm>
#include <array>

namespace relief {

static constexpr char kBase64[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

static Bytes decode_base64(const char* text, size_t size) {
  std::array<int8_t, 256> value;
  value.fill(-1);
  for (int i = 0; i < 64; i++) value[uint8_t(kBase64[i])] = int8_t(i);
  while (size > 0 && text[size - 1] == '=') size--;
  if (size % 4 == 1) throw InputError("data URI has base64 of a wrong length");
  Bytes bytes;
  bytes.reserve(size / 4 * 3 + 3);
  uint32_t bits = 0;
  for (size_t i = 0; i < size; i++) {
    int v = value[uint8_t(text[i])];
    if (v < 0) throw InputError("data URI has a character that is not base64");
    bits = bits << 6 | uint32_t(v);
    if (i % 4 != 0) bytes.push_back(uint8_t(bits >> (6 - 2 * (i % 4))));
  }
  return bytes;
}

std::optional<Bytes> decode_data_uri(const std::string& uri) {
  if (uri.rfind("data:", 0) != 0) return std::nullopt;
  size_t comma = uri.find(',');
  static const std::string kMarker = ";base64";
  if (comma == std::string::npos || comma < kMarker.size() ||
      uri.compare(comma - kMarker.size(), kMarker.size(), kMarker) != 0)
    throw InputError("data URI is not base64");
  return decode_base64(uri.data() + comma + 1, uri.size() - comma - 1);
}

std::string encode_data_uri(const Bytes& bytes) {
  std::string uri = "data:application/octet-stream;base64,";
  uri.reserve(uri.size() + (bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    size_t n = std::min<size_t>(3, bytes.size() - i);
    uint32_t bits = 0;
    for (size_t k = 0; k < 3; k++) bits = bits << 8 | (k < n ? bytes[i + k] : 0);
    for (size_t k = 0; k < 4; k++) uri += k <= n ? kBase64[bits >> (18 - 6 * k) & 63] : '=';
  }
  return uri;
}

static int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::filesystem::path resolve_uri(const std::filesystem::path& directory, const std::string& uri) {
  std::string name;
  for (size_t i = 0; i < uri.size(); i++) {
    int high = uri[i] == '%' && i + 2 < uri.size() ? hex_digit(uri[i + 1]) : -1;
    int low = high >= 0 ? hex_digit(uri[i + 2]) : -1;
    if (low >= 0) {
      name += char(high * 16 + low);
      i += 2;
    } else {
      name += uri[i];
    }
  }
  bool has_scheme = uri.find("://") != std::string::npos;
  if (name.empty() || name[0] == '/' || has_scheme || name.find('\0') != std::string::npos)
    throw InputError("URI '" + uri.substr(0, 80) + "' is not a relative path");
  return directory / name;
}

std::string escape_uri(const std::string& name) {
  static constexpr char kHex[] = "0123456789ABCDEF";
  std::string uri;
  for (char c : name) {
    uint8_t b = uint8_t(c);
    if (std::isalnum(b) || c == '-' || c == '.' || c == '_' || c == '~')
      uri += c;
    else
      uri += {'%', kHex[b >> 4], kHex[b & 15]};
  }
  return uri;
}

}  // namespace relief
