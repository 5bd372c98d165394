#include "error_ledger.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "measure/sampling.h"
#include "measure/surface_error.h"

namespace relief {
namespace {

constexpr size_t kSamples = 1'000'000;
constexpr double kCells = 250;  // spots are cells of a grid, so many to the diagonal
constexpr double kFar = 3;      // a sample is far from this multiple of the rms
constexpr size_t kSpots = 10;

// Samples of one surface with their distances to the other.
struct Samples {
  TriangleMesh points;
  std::vector<uint32_t> triangle;
  std::vector<double> distance;  // 1e-4 of the diagonal
  double squares = 0;            // sum of squared distances
};

Samples sample(const TriangleMesh& mesh, const ErrorMeter& other, double diagonal) {
  std::vector<Eigen::Vector3d> positions;
  for (const auto& p : mesh.positions) positions.emplace_back(p[0], p[1], p[2]);
  Samples s;
  for (const SurfaceSample& sample : sample_surface(positions, mesh.triangles, kSamples)) {
    const Eigen::Vector3f p = sample.point.cast<float>();
    s.points.positions.push_back({p.x(), p.y(), p.z()});
    s.triangle.push_back(sample.triangle);
  }
  for (float d : other.distance_of_positions(s.points)) {
    s.distance.push_back(double(d) / diagonal * 1e4);
    s.squares += s.distance.back() * s.distance.back();
  }
  return s;
}

double share_of_worst(std::vector<double> distances, size_t part, double squares) {
  const size_t count = distances.size() / part;
  std::nth_element(distances.begin(), distances.begin() + ptrdiff_t(count), distances.end(),
                   std::greater<>());
  double sum = 0;
  for (size_t i = 0; i < count; i++) sum += distances[i] * distances[i];
  return squares > 0 ? sum / squares : 0;
}

// Adds up samples by a number that each has; those with a number below 0 count for the whole alone.
std::vector<ErrorLedger::Part> parts_of(const Samples& s, const std::vector<int>& part, size_t parts) {
  std::vector<double> count(parts, 0), squares(parts, 0);
  for (size_t i = 0; i < s.distance.size(); i++) {
    const int p = part[s.triangle[i]];
    if (p >= 0) count[size_t(p)]++, squares[size_t(p)] += s.distance[i] * s.distance[i];
  }
  std::vector<ErrorLedger::Part> result(parts);
  for (size_t p = 0; p < parts; p++) {
    result[p].area = count[p] / double(s.distance.size());
    result[p].share = s.squares > 0 ? squares[p] / s.squares : 0;
    result[p].rms = count[p] > 0 ? std::sqrt(squares[p] / count[p]) : 0;
  }
  return result;
}

// Of each triangle: its number in kRings.
std::vector<int> rings_of(const DecodedMesh& decoded) {
  const int interior = int(kRings.size()) - 2;  // as a ring
  std::vector<int> ring(decoded.mesh.positions.size(), interior);
  for (uint32_t v : decoded.nodes) ring[v] = 0;
  auto nearest = [&](size_t t) {
    const auto& [a, b, c] = decoded.mesh.triangles[t];
    return std::min({ring[a], ring[b], ring[c]});
  };
  for (int k = 1; k < interior; k++)
    for (size_t t = 0; t < decoded.patch_triangles(); t++)
      if (nearest(t) == k - 1)
        for (uint32_t v : decoded.mesh.triangles[t]) ring[v] = std::min(ring[v], k);
  std::vector<int> rings(decoded.mesh.triangles.size(), 0);  // gaps
  for (size_t t = 0; t < decoded.patch_triangles(); t++) rings[t] = 1 + nearest(t);
  return rings;
}

// Of each triangle: its patch, or -1 in a gap. The decoder's first vertices are the pixels of all masks in
// order.
std::vector<int> patches_of(const DecodedMesh& decoded, const std::vector<uint32_t>& pixels) {
  std::vector<int> patch_of_vertex;
  for (size_t p = 0; p < pixels.size(); p++) patch_of_vertex.insert(patch_of_vertex.end(), pixels[p], int(p));
  std::vector<int> patches(decoded.mesh.triangles.size(), -1);
  for (size_t t = 0; t < decoded.patch_triangles(); t++) {
    const auto& [a, b, c] = decoded.mesh.triangles[t];
    const uint32_t first = std::min({a, b, c});
    if (first < patch_of_vertex.size()) patches[t] = patch_of_vertex[first];
  }
  return patches;
}

// far samples of one cell
struct Cell {
  ErrorLedger::Spot spot;
  double squares = 0, in_gap = 0;
};

// in_gap: of each sample
std::vector<ErrorLedger::Spot> worst_spots(const Samples& s, double diagonal,
                                           const std::vector<bool>& in_gap) {
  const double far = kFar * std::sqrt(s.squares / double(s.distance.size())), side = diagonal / kCells;
  std::map<std::array<long, 3>, Cell> cells;
  for (size_t i = 0; i < s.distance.size(); i++) {
    const double d = s.distance[i];
    if (d <= far) continue;
    const auto& p = s.points.positions[i];
    auto along = [&](size_t axis) { return std::lround(std::floor(double(p[axis]) / side)); };
    Cell& cell = cells[{along(0), along(1), along(2)}];
    cell.squares += d * d;
    if (in_gap[i]) cell.in_gap += d * d;
    if (d > cell.spot.farthest) cell.spot.farthest = d, cell.spot.place = {p[0], p[1], p[2]};
  }
  std::vector<ErrorLedger::Spot> spots;
  for (auto& [key, cell] : cells) {
    cell.spot.share = cell.squares / s.squares;
    cell.spot.gap = 2 * cell.in_gap > cell.squares;
    spots.push_back(cell.spot);
  }
  std::stable_sort(spots.begin(), spots.end(),
                   [](const auto& a, const auto& b) { return a.share > b.share; });
  spots.resize(std::min(spots.size(), kSpots));
  return spots;
}

ErrorLedger::Side side_of(const Samples& s, double diagonal, const std::vector<bool>& in_gap) {
  ErrorLedger::Side side;
  side.rms = std::sqrt(s.squares / double(s.distance.size()));
  side.max = *std::max_element(s.distance.begin(), s.distance.end());
  side.worst_100th = share_of_worst(s.distance, 100, s.squares);
  side.worst_1000th = share_of_worst(s.distance, 1000, s.squares);
  side.spots = worst_spots(s, diagonal, in_gap);
  return side;
}

// Samples of the original whose closest point is in a gap: the patches alone are farther away.
std::vector<bool> over_gaps(const Samples& s, const DecodedMesh& decoded, double diagonal) {
  TriangleMesh patches = decoded.mesh;
  patches.triangles.resize(decoded.patch_triangles());
  std::vector<bool> over(s.distance.size(), false);
  if (patches.triangles.size() == decoded.mesh.triangles.size()) return over;
  const std::vector<float> d = ErrorMeter(patches, 1).distance_of_positions(s.points);
  for (size_t i = 0; i < over.size(); i++)
    over[i] = double(d[i]) / diagonal * 1e4 > s.distance[i] * (1 + 1e-6);
  return over;
}

}  // namespace

ErrorLedger read_error_ledger(const TriangleMesh& original, const DecodedMesh& decoded,
                              const std::vector<uint32_t>& pixels) {
  const ErrorMeter to_original(original, 1), to_decoded(decoded.mesh, 1);  // only asked for distances
  ErrorLedger ledger;
  ledger.diagonal = to_original.measure(decoded.mesh).diagonal;

  const Samples of_decoded = sample(decoded.mesh, to_original, ledger.diagonal);
  const std::vector<int> rings = rings_of(decoded);
  ledger.by_ring = parts_of(of_decoded, rings, kRings.size());
  ledger.by_patch = parts_of(of_decoded, patches_of(decoded, pixels), pixels.size());
  std::vector<bool> in_gap;
  for (uint32_t t : of_decoded.triangle) in_gap.push_back(rings[t] == 0);
  ledger.to_original = side_of(of_decoded, ledger.diagonal, in_gap);

  const Samples of_original = sample(original, to_decoded, ledger.diagonal);
  ledger.to_decoded = side_of(of_original, ledger.diagonal, over_gaps(of_original, decoded, ledger.diagonal));
  return ledger;
}

}  // namespace relief
