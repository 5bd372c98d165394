#include "partition/overlap.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>
#include <unordered_map>

#include "surface/largest_first.h"

namespace relief {
namespace {

constexpr double kHeight = 3;  // spacings between two sheets over a pixel

struct Sample {
  uint64_t pixel;
  float height;  // in spacings
  int face;
};

// Adds the pixels under one triangle given in pixel coordinates (x, y) and height z.
void raster(const std::array<Vec3, 3>& t, int face, std::vector<Sample>& samples) {
  const double area =
      (t[1].x() - t[0].x()) * (t[2].y() - t[0].y()) - (t[2].x() - t[0].x()) * (t[1].y() - t[0].y());
  if (area <= 1e-12) return;
  const auto [ylo, yhi] = std::minmax({t[0].y(), t[1].y(), t[2].y()});
  // A sliver much longer than its area in pixels hits hardly any: bounds the work by the area covered.
  if (yhi - ylo > 64 * (area + 1)) return;
  for (double y = std::ceil(ylo); y <= yhi; ++y) {
    double lo = HUGE_VAL, hi = -HUGE_VAL;
    for (int k = 0; k < 3; ++k) {
      const Vec3 &a = t[k], &b = t[(k + 1) % 3];
      if (y < std::min(a.y(), b.y()) || y > std::max(a.y(), b.y())) continue;
      const double s = a.y() == b.y() ? 0 : (y - a.y()) / (b.y() - a.y());
      const double x = a.x() + s * (b.x() - a.x());
      lo = std::min({lo, x, a.y() == b.y() ? b.x() : x});
      hi = std::max({hi, x, a.y() == b.y() ? b.x() : x});
    }
    for (double x = std::ceil(lo); x <= hi; ++x) {
      const double u = ((t[1].x() - x) * (t[2].y() - y) - (t[2].x() - x) * (t[1].y() - y)) / area;
      const double v = ((t[2].x() - x) * (t[0].y() - y) - (t[0].x() - x) * (t[2].y() - y)) / area;
      const double z = u * t[0].z() + v * t[1].z() + (1 - u - v) * t[2].z();
      const auto index = [](double i) {
        return static_cast<uint64_t>(static_cast<int64_t>(i) + (int64_t{1} << 31));
      };
      samples.push_back({index(y) << 32 | (index(x) & 0xffffffffu), static_cast<float>(z), face});
    }
  }
}

// The part of its patch that each face is in while patches are split. Patches are split in parallel: a thread
// looks at the parts of its own patch's faces only.
struct Parts {
  const std::vector<int>& label;
  std::vector<int> part;
  bool together(int f, int g) const { return label[f] == label[g] && part[f] == part[g]; }
};

// Shares out the faces between the two, by distance along the surface. Returns those closer to `high`.
std::vector<int> voronoi_half(const Surface& surface, const Parts& parts, int low, int high) {
  struct Entry {
    double distance;
    int face, side;
    bool operator<(const Entry& o) const { return std::tie(o.distance, o.face) < std::tie(distance, face); }
  };
  std::vector<int> half;
  std::unordered_map<int, int> side;
  std::priority_queue<Entry> queue;
  queue.push({0, low, 0});
  queue.push({0, high, 1});
  while (!queue.empty()) {
    const Entry e = queue.top();
    queue.pop();
    if (!side.emplace(e.face, e.side).second) continue;
    if (e.side == 1) half.push_back(e.face);
    for (int g : surface.adjacent[e.face])
      if (g >= 0 && parts.together(g, e.face) && !side.count(g))
        queue.push({e.distance + (middle_of(surface, g) - middle_of(surface, e.face)).norm(), g, e.side});
  }
  return half;
}

Vec3 average_normal(const Surface& surface, const std::vector<int>& faces, const Vec3& otherwise) {
  Vec3 sum = Vec3::Zero();
  double area = 0;
  for (int f : faces) {
    sum += surface.normals[f] * surface.areas[f];
    area += surface.areas[f];
  }
  return sum.norm() > 1e-6 * area ? Vec3(sum.normalized()) : otherwise;
}

// Splits one patch until every part is a height field.
std::vector<std::vector<int>> height_fields(const Surface& surface, Parts& parts, std::vector<int> faces,
                                            const Vec3& normal, double spacing) {
  std::vector<std::vector<int>> done, todo{std::move(faces)};
  int last = 0;
  while (!todo.empty()) {
    std::vector<int> rest = std::move(todo.back());
    todo.pop_back();
    const Vec3 n = average_normal(surface, rest, normal);
    const Overlap overlap = find_overlap(surface, rest.data(), rest.data() + rest.size(), n, spacing);
    if (is_height_field(overlap)) {
      done.push_back(std::move(rest));
      continue;
    }
    std::vector<int> half = voronoi_half(surface, parts, overlap.low, overlap.high);
    ++last;
    for (int f : half) parts.part[f] = last;
    std::erase_if(rest, [&](int f) { return parts.part[f] == last; });
    todo.push_back(std::move(half));
    todo.push_back(std::move(rest));
  }
  return done;
}

}  // namespace

Overlap find_overlap(const Surface& surface, const int* begin, const int* end, const Vec3& normal,
                     double spacing) {
  const Vec3 helper = std::abs(normal.x()) < 0.7 ? Vec3::UnitX() : Vec3::UnitY();
  const Vec3 u = normal.cross(helper).normalized(), v = normal.cross(u);
  std::vector<Sample> samples;
  for (const int* f = begin; f != end; ++f) {
    if (surface.normals[*f].dot(normal) <= 0) continue;
    std::array<Vec3, 3> t;
    for (int k = 0; k < 3; ++k) {
      const Vec3& p = surface.vertices[surface.faces[*f][k]];
      t[k] = Vec3(p.dot(u), p.dot(v), p.dot(normal)) / spacing;
    }
    raster(t, *f, samples);
  }
  std::sort(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) {
    return std::tie(a.pixel, a.height, a.face) < std::tie(b.pixel, b.height, b.face);
  });
  Overlap overlap;
  float most = 0;
  for (size_t i = 0; i < samples.size();) {
    size_t j = i;
    while (j + 1 < samples.size() && samples[j + 1].pixel == samples[i].pixel) ++j;
    const float gap = samples[j].height - samples[i].height;
    if (gap > kHeight) {
      ++overlap.pixels;
      if (gap > most) {
        most = gap;
        overlap.low = samples[i].face;
        overlap.high = samples[j].face;
      }
    }
    i = j + 1;
  }
  return overlap;
}

int split_overlaps(const Surface& surface, Patches& patches, double spacing) {
  const size_t count = patches.normal.size();
  const FaceLists lists = faces_by_patch(patches.label, count);
  Parts parts{patches.label, std::vector<int>(patches.label.size(), 0)};
  std::vector<std::vector<std::vector<int>>> fields(count);
  const auto size = [&](size_t p) { return lists.size(static_cast<int>(p)); };
  largest_first(count, size, [&](size_t p) {
    const int i = static_cast<int>(p);
    fields[p] = height_fields(surface, parts, {lists.begin(i), lists.end(i)}, patches.normal[p], spacing);
  });
  for (size_t p = 0; p < count; ++p)
    for (size_t i = 1; i < fields[p].size(); ++i) {
      for (int f : fields[p][i]) patches.label[f] = static_cast<int>(patches.normal.size());
      patches.normal.push_back(patches.normal[p]);
    }
  refit(surface, patches);
  return static_cast<int>(patches.normal.size() - count);
}

}  // namespace relief
