// PLY: ascii, binary little endian, binary big endian. Any elements and properties; x, y, z, nx, ny, nz and
// red, green, blue, alpha (of one byte) of `vertex` and vertex_indices (or vertex_index) of `face` are used,
// all others are skipped.
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <optional>

#include "surface/polygons.h"
#include "surface/readers.h"
#include "surface/text_scanner.h"

namespace relief {
namespace {

enum class Type : uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };
enum class Encoding { kAscii, kLittle, kBig };
constexpr size_t kTypeBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};

struct Property {
  std::string name;
  Type type = Type::kFloat;
  std::optional<Type> count_type;  // of a list
};

struct Element {
  std::string name;
  uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Encoding encoding = Encoding::kAscii;
  std::vector<Element> elements;
};

Type parse_type(std::string_view name, const TextScanner& in) {
  constexpr std::string_view names[][2] = {{"char", "int8"},     {"uchar", "uint8"},   {"short", "int16"},
                                           {"ushort", "uint16"}, {"int", "int32"},     {"uint", "uint32"},
                                           {"float", "float32"}, {"double", "float64"}};
  for (size_t i = 0; i < std::size(names); i++)
    if (name == names[i][0] || name == names[i][1]) return Type(i);
  in.fail("unknown PLY type '" + std::string(name.substr(0, 20)) + "'");
}

Encoding parse_encoding(std::string_view name, const TextScanner& in) {
  if (name == "ascii") return Encoding::kAscii;
  if (name == "binary_little_endian") return Encoding::kLittle;
  if (name == "binary_big_endian") return Encoding::kBig;
  in.fail("unknown PLY format '" + std::string(name.substr(0, 30)) + "'");
}

Property parse_property(TextScanner& words, const TextScanner& in) {
  Property property;
  std::string_view type = words.word();
  if (type == "list") {
    property.count_type = parse_type(words.word(), in);
    if (*property.count_type >= Type::kFloat) in.fail("a list's count cannot be a floating-point number");
    type = words.word();
  }
  property.type = parse_type(type, in);
  property.name = words.word();
  return property;
}

// Leaves `in` at the first byte of the data.
Header parse_header(TextScanner& in) {
  if (in.line() != "ply") throw InputError("is not a PLY file (it does not begin with 'ply')");
  Header header;
  bool has_format = false;
  while (!in.at_end()) {
    TextScanner words(in.line());
    std::string_view keyword = words.word();
    if (keyword == "end_header") {
      if (!has_format) in.fail("the PLY header names no format");
      return header;
    }
    if (keyword == "format") {
      header.encoding = parse_encoding(words.word(), in);
      has_format = true;
    } else if (keyword == "element") {
      std::string name(words.word());
      int64_t count = words.integer();
      if (count < 0) in.fail("a negative count of '" + name + "'");
      header.elements.push_back({name, uint64_t(count), {}});
    } else if (keyword == "property") {
      if (header.elements.empty()) in.fail("a property before any element");
      header.elements.back().properties.push_back(parse_property(words, in));
    }
  }
  throw InputError("the file ends within the PLY header");
}

// Reads values of any type, one after the other.
class AsciiSource {
 public:
  explicit AsciiSource(TextScanner in) : in_(in) {}
  float real(Type) { return in_.number(); }
  int64_t integer(Type type) { return type < Type::kFloat ? in_.integer() : int64_t(in_.number()); }
  void skip(Type) { in_.number(); }
  size_t remaining() const { return in_.remaining() + 1; }  // the last value needs no white space behind it
  static size_t min_bytes(Type) { return 2; }

 private:
  TextScanner in_;
};

template <bool swap>
class BinarySource {
 public:
  explicit BinarySource(std::string_view data) : p_(data.data()), end_(p_ + data.size()) {}
  float real(Type type) {
    switch (type) {
      case Type::kFloat:
        return std::bit_cast<float>(take<uint32_t>());
      case Type::kDouble:
        return float(std::bit_cast<double>(take<uint64_t>()));
      default:
        return float(integer(type));
    }
  }
  int64_t integer(Type type) {
    switch (type) {
      case Type::kInt8:
        return take<int8_t>();
      case Type::kUint8:
        return take<uint8_t>();
      case Type::kInt16:
        return take<int16_t>();
      case Type::kUint16:
        return take<uint16_t>();
      case Type::kInt32:
        return take<int32_t>();
      case Type::kUint32:
        return take<uint32_t>();
      default:
        return to_index(real(type));
    }
  }
  void skip(Type type) {
    if (remaining() < kTypeBytes[size_t(type)]) fail();
    p_ += kTypeBytes[size_t(type)];
  }
  size_t remaining() const { return size_t(end_ - p_); }
  static size_t min_bytes(Type type) { return kTypeBytes[size_t(type)]; }

 private:
  [[noreturn]] static void fail() { throw InputError("the file ends within its data"); }

  static int64_t to_index(float value) { return value >= 0 && value < 4294967296.0f ? int64_t(value) : -1; }

  template <class T>
  T take() {
    if (remaining() < sizeof(T)) fail();
    unsigned char bytes[sizeof(T)];
    for (size_t i = 0; i < sizeof(T); i++)
      bytes[swap ? sizeof(T) - 1 - i : i] = static_cast<unsigned char>(p_[i]);
    p_ += sizeof(T);
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return value;
  }

  const char *p_, *end_;
};

template <class Source>
void check_count(const Element& element, const Source& source) {
  uint64_t bytes = 0;  // the fewest that one item can take
  for (const Property& p : element.properties) bytes += Source::min_bytes(p.count_type.value_or(p.type));
  if (bytes == 0 && element.count > 0 && (element.name == "vertex" || element.name == "face"))
    throw InputError("element '" + element.name + "' has no properties");
  if (bytes > 0 && element.count > source.remaining() / bytes)
    throw InputError("the file is too short for its " + std::to_string(element.count) + " items of '" +
                     element.name + "'");
}

template <class Source>
void skip_property(const Property& property, Source& source) {
  int64_t values = property.count_type ? source.integer(*property.count_type) : 1;
  for (int64_t i = 0; i < values; i++) source.skip(property.type);
}

template <class Source>
void read_vertices(const Element& element, Source& source, TriangleMesh& mesh) {
  // Where each property goes: 0-2 position, 3-5 normal, 6-9 colour, -1 nowhere.
  constexpr std::string_view names[] = {"x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "alpha"};
  std::vector<int> target(element.properties.size(), -1);
  std::array<int, 10> found{};
  for (size_t k = 0; k < target.size(); k++)
    for (int j = 0; j < 10; j++) {
      const Property& p = element.properties[k];
      if (p.name == names[j] && !p.count_type && (j < 6 || p.type == Type::kUint8))
        target[k] = j, found[j] = 1;
    }
  if (!found[0] || !found[1] || !found[2]) throw InputError("the vertices have no x, y and z");
  bool normals = found[3] && found[4] && found[5], colors = found[6] && found[7] && found[8];
  mesh.positions.reserve(element.count);
  if (normals) mesh.normals.reserve(element.count);
  if (colors) mesh.colors.reserve(element.count);
  for (uint64_t i = 0; i < element.count; i++) {
    float value[6] = {};
    std::array<uint8_t, 4> color = {0, 0, 0, 255};
    for (size_t k = 0; k < target.size(); k++) {
      if (target[k] >= 6)
        color[size_t(target[k] - 6)] = uint8_t(source.integer(Type::kUint8));
      else if (target[k] >= 0)
        value[target[k]] = source.real(element.properties[k].type);
      else
        skip_property(element.properties[k], source);
    }
    mesh.positions.push_back({value[0], value[1], value[2]});
    if (normals) mesh.normals.push_back({value[3], value[4], value[5]});
    if (colors) mesh.colors.push_back(color);
  }
}

template <class Source>
void read_faces(const Element& element, Source& source, uint64_t vertex_count, TriangleMesh& mesh) {
  const Property* corners = nullptr;
  for (const Property& p : element.properties)
    if (p.count_type && (p.name == "vertex_indices" || p.name == "vertex_index")) corners = &p;
  if (!corners && element.count > 0) throw InputError("the faces have no list 'vertex_indices'");
  mesh.triangles.reserve(element.count);
  PolygonFan fan(mesh, vertex_count);
  for (uint64_t i = 0; i < element.count; i++)
    for (const Property& p : element.properties) {
      if (&p != corners) {
        skip_property(p, source);
        continue;
      }
      fan.begin_face();
      int64_t count = source.integer(*p.count_type);
      if (count < 0) throw InputError("face " + std::to_string(i) + " has a negative number of vertices");
      for (int64_t k = 0; k < count; k++) fan.corner(source.integer(p.type));
    }
}

template <class Source>
TriangleMesh read_elements(const Header& header, Source source) {
  TriangleMesh mesh;
  uint64_t vertex_count = 0;  // faces may come before the vertices
  for (const Element& element : header.elements)
    if (element.name == "vertex") vertex_count = element.count;
  if (vertex_count > std::numeric_limits<uint32_t>::max())
    throw InputError("has more than 2^32 - 1 vertices");
  for (const Element& element : header.elements) {
    check_count(element, source);
    if (element.name == "vertex" && mesh.positions.empty()) {
      read_vertices(element, source, mesh);
    } else if (element.name == "face" && mesh.triangles.empty()) {
      read_faces(element, source, vertex_count, mesh);
    } else if (!element.properties.empty()) {
      for (uint64_t i = 0; i < element.count; i++)
        for (const Property& p : element.properties) skip_property(p, source);
    }
  }
  if (mesh.positions.size() != vertex_count) throw InputError("has two elements 'vertex'");
  return mesh;
}

}  // namespace

TriangleMesh read_ply(std::string_view bytes) {
  static_assert(std::endian::native == std::endian::little);
  TextScanner in(bytes);
  Header header = parse_header(in);
  std::string_view data = bytes.substr(bytes.size() - in.remaining());
  switch (header.encoding) {
    case Encoding::kLittle:
      return read_elements(header, BinarySource<false>(data));
    case Encoding::kBig:
      return read_elements(header, BinarySource<true>(data));
    default:
      return read_elements(header, AsciiSource(in));
  }
}

}  // namespace relief
