#include "seams/masks.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "points/kd_tree.h"
#include "seams/folds.h"
#include "surface/weld.h"

namespace relief {
namespace {

constexpr double kFarStray = 64;       // spacings; how far away the next surface is looked for
constexpr double kBridgeGain = 4;      // a piece is left away if that errs so many times less
constexpr size_t kMostBridged = 1024;  // pixels of such a piece, fewer
constexpr size_t kTinyPixels = 8;      // a piece as small as this is not made smaller

// Squared distance times area by which the surface is farther away without these pixels: where one of them is
// the nearest. among: those and all others that are not there.
double loss_without(const DecodedMesh& decoded, const Ground& ground, const std::vector<uint32_t>& pixels,
                    const std::vector<char>& among) {
  const Surface& s = ground.surface;
  auto place = [&](uint32_t v) { return ground.lattice(decoded.mesh.positions[v]); };
  std::vector<Vec3> own, others;
  Eigen::AlignedBox3d box;
  for (uint32_t v : pixels) own.push_back(place(v)), box.extend(own.back());
  const Vec3 reach = Vec3::Constant(box.diagonal().norm() + kFarStray * ground.spacing[pixels[0]]);
  box = Eigen::AlignedBox3d(box.min() - reach, box.max() + reach);
  for (uint32_t v = 0; v < ground.pixel.size(); v++)
    if (!among[v] && box.contains(place(v))) others.push_back(place(v));
  const KdTree near(own), rest(others);
  std::vector<Neighbour> found;
  auto square_to = [&](const KdTree& tree, const Vec3& p) {
    tree.nearest(p, 1, found);
    return found.empty() ? reach.squaredNorm() / 3 : found[0].squared;
  };
  std::set<int> seen;
  std::vector<int> faces;
  for (uint32_t v : pixels)
    if (seen.insert(ground.face[v]).second) faces.push_back(ground.face[v]);
  double loss = 0;
  for (size_t i = 0; i < faces.size(); i++) {
    const Vec3 p = middle_of(s, faces[i]);
    const double square = square_to(rest, p);
    if (square_to(near, p) >= square) continue;
    const double away = std::max(0.0, std::sqrt(square) - ground.spacing[pixels[0]] / 2);
    loss += s.areas[size_t(faces[i])] * away * away;
    for (int g : s.adjacent[size_t(faces[i])])
      if (g >= 0 && seen.insert(g).second) faces.push_back(g);
  }
  return loss;
}

using Members = std::map<int, std::vector<uint32_t>>;  // pixels of a group

// Small pieces that no link could join to the largest of their component.
void mark_strays(const DecodedMesh& decoded, const Ground& ground, const Pieces& pieces,
                 std::vector<char>& unwanted, double& lost) {
  std::vector<int> part;
  join_across_gaps(decoded, pieces.part, int(pieces.group.size()), &part);
  std::vector<int> main(pieces.main.size(),
                        -1);  // of each component of the surface: the part that holds its main group
  auto group = [&](size_t v) { return size_t(pieces.group[size_t(pieces.part[v])]); };
  for (size_t v = 0; v < ground.pixel.size(); v++) {
    const size_t component = size_t(pieces.component[group(v)]);
    if (pieces.main[component] == int(group(v))) main[component] = part[v];
  }
  Members strays;
  for (uint32_t v = 0; v < ground.pixel.size(); v++)
    if (part[v] != main[size_t(pieces.component[group(v)])] && pieces.pixels[group(v)] < kStrayPixels)
      strays[int(group(v))].push_back(v), unwanted[v] = 1;
  if (strays.empty()) return;
  for (const auto& [g, pixels] : strays) lost += loss_without(decoded, ground, pixels, unwanted);
}

using ErrorOfGroup = std::map<int, double>;

// The error of the worst faces along each small group that is not the largest of its component.
ErrorOfGroup errors_along(const DecodedMesh& decoded, const Pieces& pieces, const GapError& error) {
  ErrorOfGroup along;
  std::set<int> around;  // a face
  for (size_t f = 0; f < error.of_face.size(); f++) {
    if (error.of_face[f] <= kShareOfError * error.sum) continue;
    around.clear();
    for (size_t t = decoded.first_triangle[f]; t < decoded.face_end(f); t++)
      for (uint32_t v : decoded.mesh.triangles[t])
        if (v < pieces.part.size()) around.insert(pieces.group[size_t(pieces.part[v])]);
    for (int group : around)
      if (pieces.pixels[size_t(group)] < kMostBridged &&
          pieces.main[size_t(pieces.component[size_t(group)])] != group)
        along[group] += error.of_face[f];
  }
  return along;
}

// Small pieces whose joining to the others errs much more than leaving them away. The smallest first; those
// that are left away are not there for the others.
void mark_bridged(const DecodedMesh& decoded, const Ground& ground, const Pieces& pieces,
                  const GapError& error, std::vector<char>& unwanted, double& lost) {
  const ErrorOfGroup bridges = errors_along(decoded, pieces, error);
  if (bridges.empty()) return;
  Members members;
  for (uint32_t v = 0; v < unwanted.size(); v++) {
    const int group = pieces.group[size_t(pieces.part[v])];
    if (bridges.count(group)) members[group].push_back(v);
  }
  std::vector<std::pair<size_t, int>> order;
  for (const auto& [group, pixels] : members) order.push_back({pixels.size(), group});
  std::sort(order.begin(), order.end());
  std::vector<char> away = unwanted;
  for (const auto& [size, group] : order) {
    const std::vector<uint32_t>& pixels = members[group];
    for (uint32_t v : pixels) away[v] = 1;
    const double loss = loss_without(decoded, ground, pixels, away);
    const bool better = kBridgeGain * loss < bridges.at(group);
    if (better) lost += loss;
    for (uint32_t v : pixels) (better ? unwanted : away)[v] = better;
  }
}

int mark_coincident(const DecodedMesh& decoded, const Ground& ground, std::vector<char>& unwanted) {
  int coincident = 0;
  std::vector<char> on_border(decoded.mesh.positions.size(), 0);
  for (uint32_t v : decoded.nodes) on_border[v] = 1;
  const std::vector<uint32_t> first = weld_positions(decoded.mesh.positions);
  for (uint32_t v = 0; v < ground.pixel.size(); v++) {
    if (first[v] == v) continue;
    unwanted[on_border[v] || !on_border[first[v]] ? v : first[v]] = 1;
    coincident++;
  }
  return coincident;
}

// Corners that a face between patches has twice, where it took vertices of its own to close it: links there
// contradict one another.
void mark_tangles(const DecodedMesh& decoded, std::vector<char>& unwanted) {
  std::vector<std::pair<uint32_t, uint32_t>> sides;
  for (size_t f = 0; f < decoded.first_triangle.size(); f++) {
    sides.clear();
    bool own = false;
    for (size_t t = decoded.first_triangle[f]; t < decoded.face_end(f); t++)
      for (size_t k = 0; k < 3; k++) {
        const uint32_t a = decoded.mesh.triangles[t][k], b = decoded.mesh.triangles[t][(k + 1) % 3];
        own = own || a >= unwanted.size();
        if (a < unwanted.size() && b < unwanted.size()) sides.push_back({a, b});
      }
    if (!own) continue;
    std::sort(sides.begin(), sides.end());
    std::vector<uint32_t> rim;  // where its sides begin that are not between its triangles
    for (const auto& [a, b] : sides)
      if (!std::binary_search(sides.begin(), sides.end(), std::pair(b, a))) rim.push_back(a);
    for (size_t i = 1; i < rim.size(); i++)
      if (rim[i] == rim[i - 1]) unwanted[rim[i]] = 1;
  }
}

// How well a triangle faces the same way as the surface below its corners.
double agreement(const DecodedMesh& d, const Ground& g, size_t t, const Vec3& normal) {
  double sum = 0;
  for (uint32_t v : d.mesh.triangles[t])
    if (v < g.face.size()) sum += normal.dot(g.surface.normals[size_t(g.face[v])]);
  return sum;
}

// The corner of a triangle that lies beyond the others: that of another patch, else the blunt one.
uint32_t apex_of(const DecodedMesh& d, const Ground& g, size_t t) {
  const auto& c = d.mesh.triangles[t];
  for (size_t k = 0; k < 3; k++) {
    const uint32_t v = c[k], a = c[(k + 1) % 3], b = c[(k + 2) % 3];
    if (v < g.pixel.size() && a < g.pixel.size() && b < g.pixel.size() &&
        g.pixel[a].patch == g.pixel[b].patch && g.pixel[v].patch != g.pixel[a].patch)
      return v;
  }
  uint32_t best = c[0];
  double longest = -1;
  for (size_t k = 0; k < 3; k++) {
    const double opposite =
        (g.lattice(d.mesh.positions[c[(k + 1) % 3]]) - g.lattice(d.mesh.positions[c[(k + 2) % 3]])).norm();
    if (c[k] < g.pixel.size() && opposite > longest) longest = opposite, best = c[k];
  }
  return best;
}

void mark_folds(const DecodedMesh& decoded, const Ground& ground, const std::vector<Fold>& folds,
                std::vector<char>& unwanted) {
  for (const Fold& f : folds) {
    auto agrees = [&](uint32_t t) { return agreement(decoded, ground, t, unit_normal(decoded, ground, t)); };
    const bool first = agrees(f.triangle[0]) < agrees(f.triangle[1]);
    const uint32_t v = apex_of(decoded, ground, f.triangle[first ? 0 : 1]);
    if (v < unwanted.size()) unwanted[v] = 1;
  }
}

}  // namespace

UnwantedPixels unwanted_pixels(const DecodedMesh& decoded, const Ground& ground, const Pieces& pieces,
                               const GapError& error, const std::vector<Fold>& folds, MaskFaults& faults) {
  std::vector<char> wished(ground.pixel.size(), 0), needful(wished);
  mark_folds(decoded, ground, folds, wished);
  mark_tangles(decoded, wished);
  faults.coincident = mark_coincident(decoded, ground, needful);
  for (size_t v = 0; v < wished.size(); v++)
    if (pieces.pixels[size_t(pieces.group[size_t(pieces.part[v])])] < kTinyPixels) wished[v] = needful[v] = 0;
  mark_strays(decoded, ground, pieces, needful, faults.lost);
  mark_bridged(decoded, ground, pieces, error, needful, faults.lost);
  UnwantedPixels unwanted;
  for (uint32_t v = 0; v < wished.size(); v++)
    if (needful[v])
      unwanted.needful.push_back(v);
    else if (wished[v])
      unwanted.wished.push_back(v);
  return unwanted;
}

}  // namespace relief
