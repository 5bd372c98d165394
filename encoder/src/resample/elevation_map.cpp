#include "resample/elevation_map.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>

#include "surface/largest_first.h"

namespace relief {
namespace {

Vec3 vec(const double v[3]) { return {v[0], v[1], v[2]}; }

// The nearest normal that the stream can hold.
void quantise_normal(const Vec3& n, int32_t& u, int32_t& v) {
  constexpr double kScale = (1 << (kNormalBits - 1)) - 1;
  const double s = std::abs(n.x()) + std::abs(n.y()) + std::abs(n.z());
  double x = n.x() / s, y = n.y() / s;
  if (n.z() < 0) {
    const double ox = x;
    x = (1 - std::abs(y)) * (ox < 0 ? -1 : 1);
    y = (1 - std::abs(ox)) * (y < 0 ? -1 : 1);
  }
  u = int32_t(std::lround(x * kScale));
  v = int32_t(std::lround(y * kScale));
}

// Faces of other labels within `reach` of the patch that face its plane.
std::vector<int> ring_of(const Surface& s, const Partition& p, const PatchFaces& patch, int label,
                         double reach, std::vector<int>& stamp, int mark) {
  std::vector<int> ring;
  std::vector<Vec3> from;
  const Vec3 n = vec(patch.frame.n);
  auto visit = [&](int g, const Vec3& start) {
    if (g < 0 || p.label[g] == label || stamp[g] == mark || s.normals[g].dot(n) <= 0.1) return;
    if ((s.vertices[s.faces[g][0]] - start).norm() >= reach) return;
    stamp[g] = mark;
    ring.push_back(g);
    from.push_back(start);
  };
  for (int f : patch.own)
    for (int g : s.adjacent[f])
      if (g >= 0) visit(g, s.vertices[s.faces[g][0]]);
  for (size_t i = 0; i < ring.size(); i++) {
    const Vec3 start = from[i];
    for (int g : s.adjacent[ring[i]]) visit(g, start);
  }
  return ring;
}

// Rasterises the faces of a patch and around it onto the fine grid (3.4) and tells for each point who owns
// it.
class Rasteriser {
 public:
  Rasteriser(const Surface& s, const Ownership& o, const std::vector<PatchFaces>& patches, size_t index,
             const ElevationMap& map, FineRaster& fine)
      : s_(s),
        o_(o),
        patches_(patches),
        index_(int(index)),
        n_(vec(patches[index].frame.n)),
        fine_(fine),
        map_width_(map.width) {
    scale_ = kOversampling / map.spacing;
    ox_ = double(map.x0) * kOversampling, oy_ = double(map.y0) * kOversampling;
    oz_ = map.z0 * map.spacing;
  }

  void face(const ProjectedFace& p) {
    ProjectedFace t;
    for (int k = 0; k < 3; k++) t.x[k] = p.x[k] * scale_ - ox_, t.y[k] = p.y[k] * scale_ - oy_;
    int x0, x1, y0, y1;
    if (!range(t.x, fine_.width, x0, x1) || !range(t.y, fine_.height, y0, y1)) return;
    const double area = (t.x[1] - t.x[0]) * (t.y[2] - t.y[0]) - (t.x[2] - t.x[0]) * (t.y[1] - t.y[0]);
    if (area <= 1e-12) return;  // turned away from the plane
    for (int k = 0; k < 3; k++) t.z[k] = p.z[k] - oz_;
    const bool mixed = p.owner == ProjectedFace::kMixed;
    if (mixed) find_claims(p.face);
    const double tiny = -1e-7 * area;
    for (int y = y0; y <= y1; y++)
      for (int x = x0; x <= x1; x++) {
        const size_t i = size_t(y) * fine_.width + size_t(x);
        if (fine_.owner[i]) continue;
        const double opposite_0 = (t.x[1] - x) * (t.y[2] - y) - (t.x[2] - x) * (t.y[1] - y);
        const double opposite_1 = (t.x[2] - x) * (t.y[0] - y) - (t.x[0] - x) * (t.y[2] - y);
        if (opposite_0 < tiny || opposite_1 < tiny || area - opposite_0 - opposite_1 < tiny) continue;
        const double a = opposite_0 / area, b = opposite_1 / area, c = 1 - a - b;
        fine_.owner[i] = mixed ? owner_at(a, b, c) : p.owner;
        fine_.z[i] = float(a * t.z[0] + b * t.z[1] + c * t.z[2] + bulge_at(p.face, a, b, c));
        if (x % kOversampling == 0 && y % kOversampling == 0)
          fine_.face[size_t(y / kOversampling) * map_width_ + size_t(x / kOversampling)] = p.face;
      }
  }

 private:
  // Rows or columns that a face may cover. False: there are none.
  static bool range(const double* v, uint32_t size, int& lo, int& hi) {
    lo = std::max(0, int(std::ceil(std::min({v[0], v[1], v[2]}) - 1e-6)));
    hi = std::min(int(size) - 1, int(std::floor(std::max({v[0], v[1], v[2]}) + 1e-6)));
    return lo <= hi;
  }

  // Of point clouds: how much higher over the plane the surface lies than the face. The quadratic with the
  // given values over the middles of the edges; along the plane's normal, which may be at an angle.
  double bulge_at(int f, double a, double b, double c) const {
    if (s_.bulge.empty()) return 0;
    const auto& h = s_.bulge[size_t(f)];
    return 4 * (a * b * double(h[0]) + b * c * double(h[1]) + c * a * double(h[2])) /
           std::max(0.1, s_.normals[size_t(f)].dot(n_));
  }

  // The labels at a face's corners.
  struct Claim {
    int label;
    double weight[3];  // at each corner
    double facing;     // how well its plane faces the face
  };

  void find_claims(int f) {
    claims_.clear();
    for (size_t k = 0; k < 3; k++)
      for (const auto& [label, w] : o_.vertex[size_t(s_.faces[f][k])]) {
        auto at = std::find_if(claims_.begin(), claims_.end(), [&](auto& c) { return c.label == label; });
        if (at == claims_.end()) {
          const double facing = s_.normals[f].dot(vec(patches_[size_t(label)].frame.n));
          at = claims_.insert(at, {label, {}, std::max(0.02, facing)});
        }
        at->weight[k] = w;
      }
  }

  // The label with the largest interpolated weight times how well its plane faces the surface there.
  uint8_t owner_at(double a, double b, double c) const {
    int best = -1;
    double most = -1;
    for (const Claim& claim : claims_) {
      const double* w = claim.weight;
      const double v = (w[0] * a + w[1] * b + w[2] * c) * claim.facing;
      if (v > most || (v == most && claim.label < best)) most = v, best = claim.label;
    }
    return best == index_ ? 1 : 2;
  }

  const Surface& s_;
  const Ownership& o_;
  const std::vector<PatchFaces>& patches_;
  int index_;
  const Vec3 n_;
  FineRaster& fine_;
  size_t map_width_;
  double scale_, ox_, oy_, oz_;
  std::vector<Claim> claims_;  // of the face at hand, where several have a part of it
};

}  // namespace

std::vector<PatchFaces> gather_patches(const Surface& surface, const Partition& partition, double reach) {
  std::vector<PatchFaces> patches(partition.normal.size());
  for (size_t f = 0; f < surface.faces.size(); f++)
    if (partition.label[f] >= 0) patches[size_t(partition.label[f])].own.push_back(int(f));
  struct Stamps {
    std::vector<int> stamp;
  };
  tbb::enumerable_thread_specific<Stamps> local;
  const auto size = [&](size_t k) { return patches[k].own.size(); };
  largest_first(patches.size(), size, [&](size_t k) {
    PatchFaces& p = patches[k];
    quantise_normal(partition.normal[k], p.u, p.v);
    p.frame = frame_of(p.u, p.v);
    std::vector<int>& stamp = local.local().stamp;
    stamp.resize(surface.faces.size(), -1);
    p.ring = ring_of(surface, partition, p, int(k), reach, stamp, int(k));
  });
  return patches;
}

PatchSampler::PatchSampler(const Surface& surface, const Ownership& ownership,
                           const std::vector<PatchFaces>& patches, size_t index)
    : surface_(surface), ownership_(ownership), patches_(patches), index_(index) {
  const PatchFaces& patch = patches[index];
  faces_.reserve(patch.own.size() + patch.ring.size());
  project(patch.own);
  find_bounds();
  project(patch.ring);
}

void PatchSampler::project(const std::vector<int>& faces) {
  const Frame& frame = patches_[index_].frame;
  const Vec3 e1 = vec(frame.e1), e2 = vec(frame.e2), n = vec(frame.n);
  for (int f : faces) {
    ProjectedFace& t = faces_.emplace_back();
    t.face = f;
    for (int k = 0; k < 3; k++) {
      const Vec3& p = surface_.vertices[size_t(surface_.faces[size_t(f)][size_t(k)])];
      t.x[k] = p.dot(e1), t.y[k] = p.dot(e2), t.z[k] = p.dot(n);
    }
    const int only = ownership_.only_label(surface_.faces[size_t(f)]);
    t.owner = only < 0 ? ProjectedFace::kMixed : only == int(index_) ? 1 : 2;
  }
}

// Of the faces that are there: the patch's own.
void PatchSampler::find_bounds() {
  std::fill_n(lo_, 2, 1e300), std::fill_n(hi_, 2, -1e300);
  double area = 0, height = 0;
  for (const ProjectedFace& t : faces_) {
    lo_[0] = std::min({lo_[0], t.x[0], t.x[1], t.x[2]}), hi_[0] = std::max({hi_[0], t.x[0], t.x[1], t.x[2]});
    lo_[1] = std::min({lo_[1], t.y[0], t.y[1], t.y[2]}), hi_[1] = std::max({hi_[1], t.y[0], t.y[1], t.y[2]});
    area += surface_.areas[size_t(t.face)];
    height += surface_.areas[size_t(t.face)] * t.z[0];
  }
  height_ = area > 0 ? height / area : 0;
}

// The rectangle of the grid that holds the patch, with room for pixels that its diffused border gains.
ElevationMap PatchSampler::place_grid(double spacing) const {
  ElevationMap map;
  map.spacing = spacing;
  map.x0 = int32_t(std::floor(lo_[0] / spacing)) - 2;
  map.y0 = int32_t(std::floor(lo_[1] / spacing)) - 2;
  map.z0 = int32_t(std::lround(height_ / spacing));
  map.width = uint32_t(int32_t(std::ceil(hi_[0] / spacing)) + 3 - map.x0);
  map.height = uint32_t(int32_t(std::ceil(hi_[1] / spacing)) + 3 - map.y0);
  return map;
}

ElevationMap PatchSampler::sample(double spacing, FineRaster& fine) const {
  ElevationMap map = place_grid(spacing);
  fine.width = (map.width - 1) * kOversampling + 1;
  fine.height = (map.height - 1) * kOversampling + 1;
  fine.z.assign(size_t(fine.width) * fine.height, NAN);
  fine.owner.assign(fine.z.size(), 0);
  fine.face.assign(size_t(map.width) * map.height, -1);
  Rasteriser rasteriser(surface_, ownership_, patches_, index_, map, fine);
  for (const ProjectedFace& f : faces_) rasteriser.face(f);
  map.mask.assign(size_t(map.width) * map.height, 0);
  map.z.assign(map.mask.size(), 0);
  for (uint32_t y = 0; y < map.height; y++)
    for (uint32_t x = 0; x < map.width; x++) {
      const size_t i = size_t(y) * map.width + x, j = (size_t(y) * fine.width + x) * kOversampling;
      map.mask[i] = fine.owner[j] == 1;
      if (fine.owner[j]) map.z[i] = fine.z[j];
    }
  map.face = std::move(fine.face);
  map.pixels = size_t(std::count(map.mask.begin(), map.mask.end(), uint8_t(1)));
  return map;
}

}  // namespace relief
