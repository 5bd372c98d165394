// A stream decoded through the C API into heap blocks of exactly the promised sizes (so that AddressSanitizer
// sees one byte too many), and what every decoded mesh must be, whatever the bytes were. For the tests and
// the fuzz targets.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <type_traits>
#include <vector>

#include "relief/relief.h"
#include "sha256.h"

#if __has_include(<sanitizer/asan_interface.h>)
#include <sanitizer/asan_interface.h>
#else
#define ASAN_POISON_MEMORY_REGION(begin, size)
#define ASAN_UNPOISON_MEMORY_REGION(begin, size)
#endif

namespace relief {

// An uninitialised block of exactly `size` bytes (one if 0), aligned to 16. Its memory is that of a block
// before where it can be, as fresh memory is most of a decode's time; what no block uses is poisoned.
class HeapBlock {
 public:
  explicit HeapBlock(size_t size) : size_(size), memory_(taken(size ? size : 1)) {
    ASAN_UNPOISON_MEMORY_REGION(data(), size ? size : 1);
  }
  HeapBlock(const void* data, size_t size) : HeapBlock(size) {
    if (size) std::memcpy(this->data(), data, size);
  }
  ~HeapBlock() {
    if (memory_.capacity > kLargestKept || spare().size() == kMostKept) return;
    ASAN_POISON_MEMORY_REGION(data(), memory_.capacity);
    spare().push_back(std::move(memory_));
  }
  uint8_t* data() const { return memory_.bytes.get(); }
  size_t size() const { return size_; }
  template <class T>
  T* as() const {
    return reinterpret_cast<T*>(data());
  }

 private:
  static constexpr size_t kLargestKept = 1 << 25, kMostKept = 8;
  struct Free {
    void operator()(void* p) const { std::free(p); }
  };
  struct Memory {
    std::unique_ptr<uint8_t, Free> bytes;
    size_t capacity = 0;
  };
  static std::vector<Memory>& spare() {
    static std::vector<Memory> all;
    return all;
  }
  static Memory taken(size_t size) {  // the smallest spare one that is large enough
    auto best = spare().end();
    for (auto m = spare().begin(); m != spare().end(); ++m)
      if (m->capacity >= size && (best == spare().end() || m->capacity < best->capacity)) best = m;
    if (best == spare().end()) return allocated(size);
    Memory m = std::move(*best);
    spare().erase(best);
    return m;
  }
  static Memory allocated(size_t size) {
    if (spare().size() == kMostKept) spare().erase(spare().begin());
    void* bytes;  // malloc aligns to 8 on some machines of 32 bits, and aligned_alloc takes multiples only
    if (posix_memalign(&bytes, 16, size)) throw std::bad_alloc();
    return {std::unique_ptr<uint8_t, Free>(static_cast<uint8_t*>(bytes)), size};
  }
  size_t size_;
  Memory memory_;
};

struct Decoded {
  relief_status inspected = RELIEF_OK, status = RELIEF_OK;
  relief_info info = {};
  relief_mesh mesh = {};  // counts, bounds
  bool points = false;
  std::vector<float> positions, normals;
  std::vector<uint32_t> indices;
  std::vector<uint8_t> colors;  // 4 a vertex, or none
  size_t vertices() const { return positions.size() / 3; }
  size_t triangles() const { return indices.size() / 3; }
};

inline relief_options options_of(const relief_limits* limits, uint32_t flags = 0, uint32_t level = 0,
                                 const uint8_t* patches = nullptr) {
  return {limits, patches, level, flags, 0, 0, 0};
}

// Vectors of three numbers, `stride` bytes apart, as floats.
template <class T>
std::vector<float> unpacked(const uint8_t* bytes, size_t stride, size_t count) {
  if (std::is_same_v<T, float> && stride == 12) {
    const float* first = reinterpret_cast<const float*>(bytes);
    return {first, first + 3 * count};
  }
  std::vector<float> all;
  all.reserve(3 * count);
  for (size_t i = 0; i < count; i++, bytes += stride)
    for (size_t k = 0; k < 3; k++) {
      T value;
      std::memcpy(&value, bytes + k * sizeof(T), sizeof(T));
      all.push_back(float(value));
    }
  return all;
}

// decode: relief_decode or one like it. Quantised positions are scaled back; normals stay as they are.
template <class Decode>
Decoded decode_exactly_by(const void* data, size_t size, const relief_options* options, Decode decode) {
  Decoded d;
  const HeapBlock stream(data, size);
  const void* bytes = stream.data();
  d.status = d.inspected = relief_inspect(bytes, size, options, &d.info);
  if (d.status != RELIEF_OK) return d;
  const relief_options o = options ? *options : relief_options{};
  const bool quantised = o.flags & RELIEF_QUANTISED, narrow = o.flags & RELIEF_INDICES_16;
  d.points = o.flags & RELIEF_POINTS;
  const size_t position_stride = o.position_stride ? o.position_stride : quantised ? 8 : 12;
  const size_t normal_stride = o.normal_stride ? o.normal_stride : quantised ? 4 : 12;
  const size_t color_stride = o.color_stride ? o.color_stride : 4;
  const size_t vertices = d.info.vertex_capacity, triangles = d.info.triangle_capacity;
  const HeapBlock workspace(d.info.workspace_bytes), positions(position_stride * vertices),
      normals(normal_stride * vertices), colors(color_stride * vertices),
      indices((narrow ? 6 : 12) * triangles);
  relief_mesh& mesh = d.mesh;
  mesh.positions = positions.data(), mesh.normals = normals.data();
  mesh.colors = colors.data();
  mesh.indices = d.points ? nullptr : indices.data();
  mesh.vertex_capacity = d.info.vertex_capacity, mesh.triangle_capacity = d.info.triangle_capacity;
  d.status = decode(bytes, size, options, &mesh, workspace.data(), workspace.size());
  if (d.status != RELIEF_OK) return d;
  const size_t n = mesh.vertex_count;
  d.positions = quantised ? unpacked<int16_t>(positions.data(), position_stride, n)
                          : unpacked<float>(positions.data(), position_stride, n);
  d.normals = quantised ? unpacked<int8_t>(normals.data(), normal_stride, n)
                        : unpacked<float>(normals.data(), normal_stride, n);
  for (size_t i = 0; quantised && i < d.positions.size(); i++)
    d.positions[i] = float(mesh.offset[i % 3] + double(mesh.scale) * d.positions[i] / 32767);
  const size_t corners = 3 * size_t(mesh.triangle_count);
  if (narrow)
    d.indices.assign(indices.as<uint16_t>(), indices.as<uint16_t>() + corners);
  else
    d.indices.assign(indices.as<uint32_t>(), indices.as<uint32_t>() + corners);
  for (size_t i = 0; i < 4 * n && d.info.has_colors; i++)
    d.colors.push_back(colors.data()[i / 4 * color_stride + i % 4]);
  mesh.positions = mesh.normals = mesh.colors = mesh.indices = nullptr;
  return d;
}

inline Decoded decode_exactly(const void* data, size_t size, const relief_options* options = nullptr) {
  return decode_exactly_by(data, size, options, relief_decode);
}

// A stream that arrives piece by piece: relief_decode_more, each time with the workspace moved elsewhere.
class Arriving {
 public:
  // All bytes so far.
  Decoded decode(const void* data, size_t size, const relief_options* options = nullptr) {
    return decode_exactly_by(
        data, size, options,
        [&](const void* bytes, size_t n, const relief_options* o, relief_mesh* mesh, void*,
            size_t workspace_size) { return more(bytes, n, o, mesh, workspace_size); });
  }
  // Without a mesh.
  relief_status take(const void* data, size_t size, const relief_options* options = nullptr) {
    relief_info info;
    const relief_status status = relief_inspect(data, size, options, &info);
    return status == RELIEF_OK ? more(data, size, options, nullptr, size_t(info.workspace_bytes)) : status;
  }
  size_t taken() const { return taken_; }

 private:
  relief_status more(const void* data, size_t size, const relief_options* options, relief_mesh* mesh,
                     size_t workspace_size) {
    auto moved = std::make_unique<HeapBlock>(workspace_size);
    if (workspace_)
      std::memcpy(moved->data(), workspace_->data(), std::min(workspace_size, workspace_->size()));
    workspace_ = std::move(moved);
    return relief_decode_more(data, size, options, mesh, workspace_->data(), workspace_size, &taken_);
  }
  std::unique_ptr<HeapBlock> workspace_;
  size_t taken_ = 0;
};

// Whether two decodes gave the same, bit for bit.
inline bool same(const Decoded& a, const Decoded& b) {
  auto bytes_equal = [](const std::vector<float>& x, const std::vector<float>& y) {
    return x.size() == y.size() && (x.empty() || !std::memcmp(x.data(), y.data(), x.size() * sizeof(float)));
  };
  return a.status == b.status && bytes_equal(a.positions, b.positions) && bytes_equal(a.normals, b.normals) &&
         a.indices == b.indices && a.colors == b.colors;
}

// Options chosen by a number, in one case of four none.
inline Decoded decode_randomly(const void* data, size_t size, const relief_limits& limits, uint32_t seed) {
  auto choose = [&seed](uint32_t n) { return ((seed = seed * 1664525 + 1013904223) >> 16) % n; };
  relief_options o = options_of(&limits);
  relief_info info;
  if (choose(4) == 0 || relief_inspect(data, size, &o, &info) != RELIEF_OK)
    return decode_exactly(data, size, &o);
  o.level = choose(RELIEF_MAX_LEVEL + 1);
  o.flags = choose(2) ? RELIEF_POINTS : choose(2) ? RELIEF_SMOOTH : 0;
  if (choose(2)) o.flags |= RELIEF_QUANTISED;
  if (choose(2)) o.flags |= RELIEF_INDICES_16;
  if (choose(3) == 0) o.position_stride = 12 + 4 * choose(4);
  if (choose(3) == 0) o.normal_stride = 12 + 4 * choose(4);
  if (choose(3) == 0) o.color_stride = 4 + 4 * choose(4);
  std::vector<uint8_t> patches(info.patch_count);
  for (uint8_t& wanted : patches) wanted = uint8_t(choose(3));
  if (choose(2)) o.patches = patches.data();
  return decode_exactly(data, size, &o);
}

// A mesh by its corners: an entry for each directed edge from -> to with the third corner of its triangle,
// sorted.
class DirectedEdges {
 public:
  // indices: all below `vertices`
  DirectedEdges(const std::vector<uint32_t>& indices, size_t vertices)
      : begin_(vertices + 1, 0), block_(indices.size() * sizeof(Entry)), entries_(block_.as<Entry>()) {
    const size_t edges = indices.size();
    for (uint32_t i : indices) begin_[i + 1]++;
    for (size_t v = 0; v < vertices; v++) begin_[v + 1] += begin_[v];
    // Each vertex has as many edges that come as edges that go: in the order of where they end, then from
    // where they begin.
    const HeapBlock by_end(edges * sizeof(uint32_t));
    std::vector<uint32_t> at(begin_.begin(), begin_.end());
    for (uint32_t i = 0; i < edges; i++) by_end.as<uint32_t>()[at[indices[next(i)]]++] = i;
    at.assign(begin_.begin(), begin_.end());
    for (size_t i = 0; i < edges; i++) {
      const uint32_t e = by_end.as<uint32_t>()[i];
      entries_[at[indices[e]]++] = {indices[next(e)], indices[next(next(e))]};
    }
  }

  bool unique() const {
    for (size_t v = 0; v + 1 < begin_.size(); v++)
      for (size_t i = begin_[v] + 1; i < begin_[v + 1]; i++)
        if (entries_[i].to == entries_[i - 1].to) return false;
    return true;
  }

  size_t open() const {
    size_t n = 0;
    for (uint32_t v = 0; v + 1 < begin_.size(); v++)
      for (size_t i = begin_[v]; i < begin_[v + 1]; i++) n += !find(entries_[i].to, v);
    return n;
  }

  // Whether every vertex has triangles and they follow one another in one fan, closed or open. Needs
  // unique().
  bool one_fan_each() const {
    for (uint32_t v = 0; v + 1 < begin_.size(); v++) {
      if (begin_[v] == begin_[v + 1]) return false;
      const Entry* first = entries_ + begin_[v];
      for (size_t i = begin_[v]; i < begin_[v + 1]; i++)
        if (!find(entries_[i].to, v)) first = entries_ + i;  // a fan begins at a border
      size_t visited = 0;
      const Entry* e = first;
      do {
        visited++;
        e = find(v, e->third);
      } while (e && e != first);
      if (visited != begin_[v + 1] - begin_[v]) return false;
    }
    return true;
  }

 private:
  struct Entry {
    uint32_t to, third;
  };
  static uint32_t next(uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
  const Entry* find(uint32_t from, uint32_t to) const {
    const Entry *begin = entries_ + begin_[from], *end = entries_ + begin_[from + 1];
    const Entry* e = std::lower_bound(begin, end, to, [](const Entry& a, uint32_t b) { return a.to < b; });
    return e != end && e->to == to ? e : nullptr;
  }
  std::vector<uint32_t> begin_;  // of the entries of each vertex
  HeapBlock block_;
  Entry* entries_;
};

// What is wrong with a decoded mesh, or "". closed: it must have no border.
inline std::string fault_of(const Decoded& d, bool closed = false) {
  if (d.vertices() > d.info.vertex_capacity || d.triangles() > d.info.triangle_capacity)
    return "more than the promised capacity";
  for (float f : d.positions)
    if (!std::isfinite(f)) return "a position is not finite";
  for (size_t i = 0; i < d.normals.size(); i += 3) {
    const float* n = &d.normals[i];
    const float square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    if (!(std::fabs(square - 1) < 1e-4f || std::fabs(std::sqrt(square) - 127) < 1))  // of int8
      return "a normal is not of unit length";
  }
  for (size_t i = 0; i < d.positions.size(); i++) {
    const double least = d.mesh.min[i % 3], most = d.mesh.max[i % 3];
    const double slack =  // of quantised ones
        d.mesh.scale > 0 ? double(d.mesh.scale) / 32767 + 1e-6 * std::fabs(d.positions[i]) : 0;
    if (d.positions[i] < least - slack || d.positions[i] > most + slack) return "a position is out of bounds";
  }
  if (d.info.has_colors && d.colors.size() != 4 * d.vertices()) return "a vertex has no colour";
  for (size_t i = 3; i < d.colors.size(); i += 4)
    if (d.colors[i] != 255) return "a colour is not opaque";
  if (d.points) return d.triangles() ? "points have triangles" : "";
  for (uint32_t i : d.indices)
    if (i >= d.vertices()) return "an index is out of range";
  for (size_t t = 0; t < d.indices.size(); t += 3) {
    const uint32_t *v = &d.indices[t], a = v[0], b = v[1], c = v[2];
    if (a == b || b == c || c == a) return "a triangle has a vertex twice";
  }
  const DirectedEdges edges(d.indices, d.vertices());
  if (!edges.unique()) return "an edge is used twice in the same direction";
  if (!edges.one_fan_each()) return "the triangles around a vertex are none or more than one fan";
  if (closed && edges.open()) return "the surface is not closed";
  return "";
}

// SHA-256 of positions, normals, indices and, if there are any, colours as little-endian bytes, one array
// after the other.
inline std::string hash_of(const Decoded& d) {
  std::vector<uint8_t> bytes;
  auto put = [&](uint32_t v) {
    for (int i = 0; i < 32; i += 8) bytes.push_back(uint8_t(v >> i));
  };
  auto put_floats = [&](const std::vector<float>& values) {
    for (float f : values) {
      uint32_t bits;
      std::memcpy(&bits, &f, 4);
      put(bits);
    }
  };
  put_floats(d.positions);
  put_floats(d.normals);
  for (uint32_t i : d.indices) put(i);
  bytes.insert(bytes.end(), d.colors.begin(), d.colors.end());
  return sha256(std::move(bytes));
}

}  // namespace relief
