// Wavefront OBJ: v (with colours behind the coordinates, as many programs write them), vn and f; all groups
// and objects become one mesh, everything else is skipped.
#include <algorithm>
#include <cmath>
#include <limits>

#include "surface/polygons.h"
#include "surface/readers.h"
#include "surface/text_scanner.h"

namespace relief {
namespace {

constexpr uint32_t kUnset = std::numeric_limits<uint32_t>::max();

class ObjReader {
 public:
  explicit ObjReader(std::string_view bytes) : in_(bytes) {}

  TriangleMesh read() {
    while (!in_.at_end()) {
      if (!in_.more_on_line()) {
        in_.skip_line();
        continue;
      }
      std::string_view keyword = in_.word();
      if (keyword == "v") {
        mesh_.positions.push_back(vector());
        color();
      } else if (keyword == "vn") {
        file_normals_.push_back(vector());
      } else if (keyword == "f") {
        face();
      }
      skip_rest();
    }
    finish();
    return std::move(mesh_);
  }

 private:
  struct Corner {
    uint32_t position, normal;
  };

  std::array<float, 3> vector() {
    std::array<float, 3> v;
    for (float& c : v) {
      next_on_line("a number");
      c = in_.number();
    }
    return v;
  }

  // Three numbers after the coordinates; a single one is a weight.
  void color() {
    std::array<float, 3> c{};
    size_t count = 0;
    for (; count < 3 && more(); count++) c[count] = in_.number();
    if (count == 3) file_colors_.push_back(c);
  }

  // A backslash at the end of a line continues it.
  bool more() {
    while (in_.more_on_line()) {
      if (!in_.accept('\\')) return true;
      in_.more_on_line();
      if (!in_.accept('\n')) in_.fail("a backslash within a line");
    }
    return false;
  }

  void next_on_line(const char* what) {
    if (!more()) in_.fail(std::string("the line ends where ") + what + " should be");
  }

  void skip_rest() {
    while (true) {
      std::string_view rest = in_.line();
      if (in_.at_end() || rest.empty() || rest.back() != '\\') return;
    }
  }

  // Indices count from 1; negative ones from the end of what was read so far.
  uint32_t resolve(int64_t index, size_t count) {
    int64_t i = index < 0 ? int64_t(count) + index : index - 1;
    if (i < 0 || i >= int64_t(kUnset)) fail_index(faces_, index, count);
    if (uint64_t(i) > largest_) largest_ = uint64_t(i), largest_face_ = faces_;
    return uint32_t(i);
  }

  Corner corner() {
    Corner c{resolve(in_.integer("/"), mesh_.positions.size()), kUnset};
    if (!in_.accept('/')) return c;
    if (!in_.accept('/')) {
      in_.integer("/");
      if (!in_.accept('/')) return c;
    }
    int64_t n = in_.integer("/");
    int64_t i = n < 0 ? int64_t(file_normals_.size()) + n : n - 1;
    if (i >= 0 && uint64_t(i) < file_normals_.size()) c.normal = uint32_t(i);
    return c;
  }

  void face() {
    Corner first{}, last{};
    for (size_t k = 0; more(); k++) {
      Corner c = corner();
      note_normal(c);
      if (k == 0) first = c;
      if (k >= 2) mesh_.triangles.push_back({first.position, last.position, c.position});
      last = c;
    }
    faces_++;
  }

  // Normals are kept if every vertex has one and only one.
  void note_normal(Corner c) {
    if (!keep_normals_) return;
    if (c.normal == kUnset) {
      keep_normals_ = false;
      return;
    }
    if (c.position >= mesh_.positions.size()) return;  // finish() will complain or there is no normal to keep
    if (normal_of_.size() <= c.position) normal_of_.resize(mesh_.positions.size(), kUnset);
    uint32_t& n = normal_of_[c.position];
    if (n != kUnset && n != c.normal && file_normals_[n] != file_normals_[c.normal]) keep_normals_ = false;
    n = c.normal;
  }

  // A face may come before its vertices, so the range is known only now.
  void finish() {
    size_t count = mesh_.positions.size();
    if (count >= kUnset) throw InputError("has more than 2^32 - 2 vertices");
    if (!mesh_.triangles.empty() && largest_ >= count)
      fail_index(largest_face_, int64_t(largest_) + 1, count);
    if (file_colors_.size() == count) keep_colors();
    if (!keep_normals_ || normal_of_.size() != count) return;
    for (uint32_t n : normal_of_)
      if (n == kUnset) return;
    mesh_.normals.reserve(count);
    for (uint32_t n : normal_of_) mesh_.normals.push_back(file_normals_[n]);
  }

  // They go to 1, or to 255 if any is larger than 1.
  void keep_colors() {
    float largest = 0;
    for (const auto& c : file_colors_) largest = std::max({largest, c[0], c[1], c[2]});
    const float scale = largest > 1 ? 1 : 255;
    auto byte = [scale](float v) { return uint8_t(std::lround(v > 0 ? std::min(scale * v, 255.0f) : 0.0f)); };
    for (const auto& c : file_colors_) mesh_.colors.push_back({byte(c[0]), byte(c[1]), byte(c[2]), 255});
  }

  [[noreturn]] static void fail_index(size_t face, int64_t index, size_t count) {
    throw InputError("face " + std::to_string(face) + ": vertex index " + std::to_string(index) +
                     " is out of range (" + std::to_string(count) + " vertices)");
  }

  TextScanner in_;
  TriangleMesh mesh_;
  std::vector<std::array<float, 3>> file_normals_, file_colors_;
  std::vector<uint32_t> normal_of_;  // of each vertex
  bool keep_normals_ = true;
  size_t faces_ = 0, largest_face_ = 0;
  uint64_t largest_ = 0;
};

}  // namespace

TriangleMesh read_obj(std::string_view bytes) { return ObjReader(bytes).read(); }

}  // namespace relief
