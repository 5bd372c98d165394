// PCD (Point Cloud Data, version 0.7), ascii and binary: x, y, z, normal_x, normal_y, normal_z and rgb or
// rgba of a cloud; all other fields are skipped. Points whose position is not a number mark what a scanner
// did not see; they are left out.
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "surface/readers.h"
#include "surface/text_scanner.h"

namespace relief {
namespace {

struct Field {
  std::string name;
  uint64_t size = 0, count = 1;
  char type = 0;  // I, U, F
};

struct Header {
  std::vector<Field> fields;
  uint64_t points = 0;
  bool binary = false;
};

// The words of a line that has one for each field.
template <class Set>
void each_field(Header& header, TextScanner& words, const TextScanner& in, const char* what, Set set) {
  for (Field& f : header.fields) {
    if (!words.more_on_line()) in.fail(std::string("fewer words than fields after ") + what);
    set(f, words);
  }
}

uint64_t parse_count(TextScanner& words, const TextScanner& in, const char* what, uint64_t most) {
  const int64_t count = words.integer();
  if (count < 0 || uint64_t(count) > most) in.fail(std::string(what) + " is out of range");
  return uint64_t(count);
}

void parse_data_kind(Header& header, std::string_view kind, const TextScanner& in) {
  if (kind != "ascii" && kind != "binary")
    in.fail("PCD data of the kind '" + std::string(kind.substr(0, 30)) +
            "' cannot be read (ascii and binary can)");
  header.binary = kind == "binary";
}

// Leaves `in` at the first byte of the data.
Header parse_header(TextScanner& in) {
  constexpr uint64_t kMostFields = 256, kMostValues = 1 << 20;
  Header header;
  bool has_points = false;
  while (!in.at_end()) {
    TextScanner words(in.line());
    const std::string_view keyword = words.word();
    if (keyword == "FIELDS" || keyword == "COLUMNS") {
      while (words.more_on_line()) header.fields.push_back({std::string(words.word()), 0, 1, 0});
      if (header.fields.size() > kMostFields) in.fail("too many fields");
    } else if (keyword == "SIZE") {
      each_field(header, words, in, "SIZE", [&](Field& f, TextScanner& w) {
        f.size = parse_count(w, in, "a size", 8);
        if (!std::has_single_bit(f.size)) in.fail("a size must be 1, 2, 4 or 8");
      });
    } else if (keyword == "TYPE") {
      each_field(header, words, in, "TYPE", [&](Field& f, TextScanner& w) {
        const std::string_view type = w.word();
        if (type != "I" && type != "U" && type != "F") in.fail("a type must be I, U or F");
        f.type = type[0];
      });
    } else if (keyword == "COUNT") {
      each_field(header, words, in, "COUNT",
                 [&](Field& f, TextScanner& w) { f.count = parse_count(w, in, "a count", kMostValues); });
    } else if (keyword == "POINTS") {
      header.points = parse_count(words, in, "the number of points", std::numeric_limits<uint32_t>::max());
      has_points = true;
    } else if (keyword == "DATA") {
      if (header.fields.empty() || !has_points) in.fail("the PCD header lacks FIELDS or POINTS");
      parse_data_kind(header, words.word(), in);
      return header;
    }
  }
  throw InputError("is not a PCD file (it has no line 'DATA')");
}

// Where the fields go: 0-2 position, 3-5 normal, 6 colour, -1 nowhere.
std::vector<int> targets(const Header& header) {
  constexpr std::string_view names[] = {"x", "y", "z", "normal_x", "normal_y", "normal_z", "rgb", "rgba"};
  std::vector<int> target;
  uint32_t found = 0;
  for (const Field& f : header.fields) {
    target.push_back(-1);
    if (f.size == 0 || f.type == 0) throw InputError("field '" + f.name + "' has no SIZE or TYPE");
    if (f.type == 'F' && f.size < 4) throw InputError("field '" + f.name + "' is a number of too few bytes");
    for (int k = 0; k < 8; k++)
      if (f.name == names[k] && f.count == 1 && (k < 6 ? f.type == 'F' : f.size == 4))
        target.back() = std::min(k, 6);
    if (target.back() >= 0) found |= 1u << target.back();
  }
  if ((found & 7) != 7) throw InputError("the points have no x, y and z of type F");
  if ((found & 0x38) != 0x38)
    for (int& t : target)
      if (t >= 3 && t <= 5) t = -1;
  return target;
}

struct Point {
  float value[6] = {};
  uint32_t color = 0;  // opacity, red, green, blue from the highest byte
};

void add(const Point& p, bool normals, bool colors, bool opacity, TriangleMesh& cloud) {
  if (!std::isfinite(p.value[0]) || !std::isfinite(p.value[1]) || !std::isfinite(p.value[2])) return;
  cloud.positions.push_back({p.value[0], p.value[1], p.value[2]});
  if (normals) cloud.normals.push_back({p.value[3], p.value[4], p.value[5]});
  if (colors)
    cloud.colors.push_back({uint8_t(p.color >> 16), uint8_t(p.color >> 8), uint8_t(p.color),
                            opacity ? uint8_t(p.color >> 24) : uint8_t(255)});
}

uint64_t bytes_of(const Header& header) {
  uint64_t bytes = 0;
  for (const Field& f : header.fields) bytes += f.size * f.count;
  return bytes;
}

// One point's worth of data.
void read_binary(const Header& header, const std::vector<int>& target, const char*& p, Point& point) {
  for (size_t i = 0; i < header.fields.size(); i++) {
    const Field& f = header.fields[i];
    if (target[i] >= 0 && f.size == 4) {
      std::memcpy(target[i] < 6 ? static_cast<void*>(&point.value[target[i]]) : &point.color, p, 4);
    } else if (target[i] >= 0) {
      double value;
      std::memcpy(&value, p, 8);
      point.value[target[i]] = float(value);
    }
    p += f.size * f.count;
  }
}

void read_ascii(const Header& header, const std::vector<int>& target, TextScanner& in, Point& point) {
  for (size_t i = 0; i < header.fields.size(); i++) {
    const Field& f = header.fields[i];
    for (uint64_t k = 0; k < f.count; k++) {
      if (target[i] < 0)
        in.number();
      else if (target[i] < 6)
        point.value[target[i]] = in.number();
      else if (f.type == 'F')
        point.color = std::bit_cast<uint32_t>(in.number());  // the bits of a float, as PCL writes it
      else
        point.color = uint32_t(in.integer());
    }
  }
}

}  // namespace

TriangleMesh read_pcd(std::string_view bytes) {
  static_assert(std::endian::native == std::endian::little);
  TextScanner in(bytes);
  const Header header = parse_header(in);
  const std::vector<int> target = targets(header);
  uint64_t values = 0;
  for (const Field& f : header.fields) values += f.count;
  const uint64_t least = header.binary ? bytes_of(header) : 2 * values;  // bytes of a point
  if (header.points > (in.remaining() + 1) / least ||
      (header.binary && header.points * least > in.remaining()))
    throw InputError("the file is too short for its " + std::to_string(header.points) + " points");
  auto has = [&](int k) { return std::find(target.begin(), target.end(), k) != target.end(); };
  bool opacity = false;
  for (const Field& f : header.fields) opacity = opacity || f.name == "rgba";
  TriangleMesh cloud;
  const char* p = bytes.data() + (bytes.size() - in.remaining());
  for (uint64_t i = 0; i < header.points; i++) {
    Point point;
    if (header.binary)
      read_binary(header, target, p, point);
    else
      read_ascii(header, target, in, point);
    add(point, has(3), has(6), opacity, cloud);
  }
  return cloud;
}

}  // namespace relief
