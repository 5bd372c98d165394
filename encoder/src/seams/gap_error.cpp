#include "seams/gap_error.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <unordered_set>

#include "measure/closest_point.h"

namespace relief {
namespace {

constexpr double kLong = 3;  // spacings; an edge of a triangle that is looked at in more than one point

uint64_t mixed(uint64_t h) {
  h = (h ^ h >> 32) * 0xd6e8feb86659fd93ull;
  return h ^ h >> 32;
}

uint64_t key_of(const TriangleMesh& m, size_t t) {
  uint64_t key = 0;  // the order of the corners does not matter
  for (uint32_t v : m.triangles[t]) {
    uint64_t h = 0;
    for (float c : m.positions[v]) h = mixed(h ^ std::bit_cast<uint32_t>(c));
    key += h;
  }
  return key;
}

double longest_edge(const std::array<Vec3, 3>& p) {
  return std::max({(p[1] - p[0]).norm(), (p[2] - p[1]).norm(), (p[0] - p[2]).norm()});
}

// Long triangles are looked at in the middles of their edges, others in their own middle.
void measure_unknown(GapError& g, const DistanceToSurface& distance, double spacing, KnownTriangles& known) {
  struct Probe {
    size_t triangle;
    float share;
  };
  std::vector<Vec3> points;
  std::vector<Probe> probes;
  for (size_t t = 0; t < g.key.size(); t++) {
    const auto& p = g.corner[t];
    const auto at = known.find(g.key[t]);
    if (at != known.end()) {
      g.squared[t] = at->second;
    } else if (longest_edge(p) > kLong * spacing) {
      for (size_t k = 0; k < 3; k++) {
        points.push_back((p[k] + p[(k + 1) % 3]) / 2);
        probes.push_back({t, 1 / 3.0f});
      }
    } else {
      points.push_back((p[0] + p[1] + p[2]) / 3);
      probes.push_back({t, 1});
    }
  }
  if (points.empty()) return;
  const std::vector<float> d = distance(points);
  for (size_t i = 0; i < probes.size(); i++) g.squared[probes[i].triangle] += probes[i].share * d[i] * d[i];
  for (const Probe& p : probes) known[g.key[p.triangle]] = g.squared[p.triangle];
}

// A triangle in a ball, which tells of most that they are too far away.
struct Placed {
  size_t triangle;
  std::array<Vec3, 3> corner;
  Vec3 middle;
  double radius;
};

// The triangles of `these` that `others` lack.
std::vector<Placed> not_in(const GapError& others, const GapError& these) {
  const std::unordered_set<uint64_t> known(others.key.begin(), others.key.end());
  std::vector<Placed> found;
  for (size_t t = 0; t < these.key.size(); t++) {
    if (known.count(these.key[t])) continue;
    const auto& p = these.corner[t];
    const Vec3 middle = (p[0] + p[1] + p[2]) / 3;
    const double radius = std::max({(p[0] - middle).norm(), (p[1] - middle).norm(), (p[2] - middle).norm()});
    found.push_back({t, p, middle, radius});
  }
  return found;
}

}  // namespace

GapError gap_error(const DecodedMesh& decoded, const Ground& ground, const DistanceToSurface& distance,
                   double spacing, KnownTriangles& known) {
  GapError g;
  const size_t first = decoded.patch_triangles(), count = decoded.mesh.triangles.size() - first;
  g.squared.assign(count, 0);
  for (size_t t = first; t < decoded.mesh.triangles.size(); t++) {
    std::array<Vec3, 3> p;
    for (size_t k = 0; k < 3; k++)
      p[k] = ground.lattice(decoded.mesh.positions[decoded.mesh.triangles[t][k]]);
    g.area.push_back((p[1] - p[0]).cross(p[2] - p[0]).norm() / 2);
    g.key.push_back(key_of(decoded.mesh, t));
    g.corner.push_back(p);
  }
  measure_unknown(g, distance, spacing, known);
  g.of_face.assign(decoded.first_triangle.size(), 0);
  for (size_t f = 0; f < g.of_face.size(); f++) {
    for (size_t t = decoded.first_triangle[f]; t < decoded.face_end(f); t++)
      g.of_face[f] += double(g.squared[t - first]) * g.area[t - first];
    g.sum += g.of_face[f];
  }
  return g;
}

std::vector<float> distances_of_middles(const DecodedMesh& decoded, const Ground& ground,
                                        const DistanceToSurface& distance, KnownTriangles& known) {
  const size_t first = decoded.patch_triangles(), count = decoded.mesh.triangles.size() - first;
  std::vector<float> found(count);
  std::vector<Vec3> points;
  std::vector<std::pair<size_t, uint64_t>> unknown;  // triangles with their keys
  for (size_t t = 0; t < count; t++) {
    const uint64_t key = key_of(decoded.mesh, first + t);
    if (const auto at = known.find(key); at != known.end()) {
      found[t] = at->second;
      continue;
    }
    Vec3 middle = Vec3::Zero();
    for (uint32_t v : decoded.mesh.triangles[first + t])
      middle += ground.lattice(decoded.mesh.positions[v]) / 3;
    points.push_back(middle);
    unknown.push_back({t, key});
  }
  if (points.empty()) return found;
  const std::vector<float> d = distance(points);
  for (size_t i = 0; i < unknown.size(); i++) found[unknown[i].first] = known[unknown[i].second] = d[i];
  return found;
}

double laid_bare(const GapError& before, const GapError& after) {
  const std::vector<Placed> added = not_in(before, after), removed = not_in(after, before);
  double sum = 0;
  for (const Placed& r : removed) {
    const auto& p = r.corner;
    for (const Vec3& q :
         {r.middle, Vec3((r.middle + p[0]) / 2), Vec3((r.middle + p[1]) / 2), Vec3((r.middle + p[2]) / 2)}) {
      double least = INFINITY;  // the corners are still there
      for (const Vec3& v : p) least = std::min(least, (v - q).norm());
      for (const Placed& a : added)
        if ((a.middle - q).norm() < least + a.radius)
          least = std::min(least, std::sqrt(squared_distance(q, a.corner[0], a.corner[1], a.corner[2])));
      // the surface is only about where the triangle was
      const double away = std::max(0.0, least - 2 * std::sqrt(double(before.squared[r.triangle])));
      sum += away * away * before.area[r.triangle] / 4;
    }
  }
  return sum;
}

}  // namespace relief
