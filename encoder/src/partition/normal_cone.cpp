#include "partition/normal_cone.h"

#include <tbb/parallel_for.h>

#include <cmath>

namespace relief {
namespace {

constexpr double kFoldedShare =
    2e-5;  // of the surface's area; measured: smaller values add patches, not precision
constexpr int kSmoothingRounds = 8;     // about as many rings of faces
constexpr int kSmallestSmoothed = 200;  // faces; a smaller component would be smoothed into a ball
constexpr double kCellAngle = 12;       // degrees between the normals of a cell

// Faces whose normals are smoothed. A face that alone exceeds the tolerated folded area is no noise.
std::vector<char> smoothed_faces(const Surface& surface, double folded_area) {
  std::vector<int> size(surface.component_area.size(), 0);
  for (int c : surface.component) ++size[c];
  std::vector<char> smoothed(surface.faces.size());
  for (size_t f = 0; f < smoothed.size(); ++f)
    smoothed[f] = size[surface.component[f]] >= kSmallestSmoothed && surface.areas[f] <= folded_area;
  return smoothed;
}

void smooth_normals(const Surface& surface, double folded_area, std::vector<Eigen::Vector3f>& normals) {
  const std::vector<char> smoothed = smoothed_faces(surface, folded_area);
  std::vector<Eigen::Vector3f> next(normals.size());
  for (int round = 0; round < kSmoothingRounds; ++round) {
    tbb::parallel_for(size_t{0}, normals.size(), [&](size_t f) {
      next[f] = normals[f];
      if (!smoothed[f]) return;
      double weight = surface.areas[f];
      Vec3 sum = normals[f].cast<double>() * weight;
      for (int g : surface.adjacent[f])
        if (g >= 0) {
          sum += normals[g].cast<double>() * surface.areas[g];
          weight += surface.areas[g];
        }
      if (sum.norm() > 0.05 * weight) next[f] = sum.normalized().cast<float>();
    });
    normals.swap(next);
  }
}

// Gathers faces around `face` that are in no cell yet, breadth first.
std::vector<int> cell_around(const NormalCone& faces, int face, size_t most, std::vector<int>& cell,
                             int number) {
  const double epsilon = std::cos(kCellAngle * M_PI / 180);
  std::vector<int> members{face};
  cell[face] = number;
  for (size_t i = 0; i < members.size(); ++i)
    for (int j = faces.cells.first[members[i]]; j < faces.cells.first[members[i] + 1]; ++j) {
      const int g = faces.cells.neighbour[j];
      if (members.size() == most || cell[g] >= 0) continue;
      if (faces.cells.smooth[g].dot(faces.cells.smooth[face]) < epsilon) continue;
      cell[g] = number;
      members.push_back(g);
    }
  return members;
}

void add_cell(const Cells& faces, const std::vector<int>& members, Cells& cells) {
  Vec3 own = Vec3::Zero(), smooth = Vec3::Zero();
  double area = 0;
  for (int f : members) {
    own += faces.own[f].cast<double>() * faces.area[f];
    smooth += faces.smooth[f].cast<double>() * faces.area[f];
    area += faces.area[f];
  }
  cells.own.push_back(area > 0 ? Eigen::Vector3f((own / area).cast<float>()) : Eigen::Vector3f::Zero());
  cells.smooth.push_back(smooth.norm() > 0 ? Eigen::Vector3f(smooth.normalized().cast<float>())
                                           : faces.smooth[members[0]]);
  cells.area.push_back(area);
}

}  // namespace

NormalCone make_normal_cone(const Surface& surface, double aperture) {
  NormalCone cone;
  cone.cosine = std::cos(aperture * M_PI / 180);
  cone.folded_area = kFoldedShare * surface.total_area;
  Cells& cells = cone.cells;
  cells.first.push_back(0);
  for (size_t f = 0; f < surface.faces.size(); ++f) {
    cells.own.push_back(surface.normals[f].cast<float>());
    for (int g : surface.adjacent[f])
      if (g >= 0) cells.neighbour.push_back(g);
    cells.first.push_back(static_cast<int>(cells.neighbour.size()));
  }
  cells.area = surface.areas;
  cells.smooth = cells.own;
  smooth_normals(surface, cone.folded_area, cells.smooth);
  return cone;
}

NormalCone coarsen(const NormalCone& faces, int most, std::vector<int>& cell) {
  NormalCone cone;
  cone.cosine = faces.cosine;
  cone.folded_area = faces.folded_area;
  cell.assign(faces.cells.area.size(), -1);
  std::vector<std::vector<int>> members;
  for (size_t f = 0; f < cell.size(); ++f) {
    if (cell[f] >= 0) continue;
    members.push_back(cell_around(faces, static_cast<int>(f), most, cell, static_cast<int>(members.size())));
    add_cell(faces.cells, members.back(), cone.cells);
  }
  std::vector<int>& neighbour = cone.cells.neighbour;
  cone.cells.first.push_back(0);
  for (size_t c = 0; c < members.size(); ++c) {
    const auto begin = static_cast<std::ptrdiff_t>(neighbour.size());
    for (int f : members[c])
      for (int j = faces.cells.first[f]; j < faces.cells.first[f + 1]; ++j) {
        const int d = cell[faces.cells.neighbour[j]];
        if (d != static_cast<int>(c)) neighbour.push_back(d);
      }
    std::sort(neighbour.begin() + begin, neighbour.end());
    neighbour.erase(std::unique(neighbour.begin() + begin, neighbour.end()), neighbour.end());
    cone.cells.first.push_back(static_cast<int>(neighbour.size()));
  }
  return cone;
}

double aperture_cosine(const NormalCone& cone, const int* begin, const int* end, const Vec3& n) {
  float least = 1;
  const Eigen::Vector3f m = n.cast<float>();
  for (const int* c = begin; c != end; ++c)
    least = std::min(least, std::max(cone.cells.smooth[*c].dot(m), cone.cells.own[*c].dot(m)));
  return least;
}

std::vector<FoldedRegion> folded_regions(const NormalCone& cone, const std::vector<int>& label, int p,
                                         const int* begin, const int* end, const Vec3& n,
                                         std::vector<int>& mark, int stamp) {
  const Cells& cells = cone.cells;
  std::vector<FoldedRegion> regions;
  double patch_area = 0;
  for (const int* c = begin; c != end; ++c) {
    patch_area += cells.area[*c];
    if (mark[*c] == stamp || cone.inside(*c, n)) continue;
    FoldedRegion region;
    float least = 2;
    region.cells.push_back(*c);
    mark[*c] = stamp;
    for (size_t i = 0; i < region.cells.size(); ++i) {
      const int g = region.cells[i];
      region.area += cells.area[g];
      const float cosine = cells.smooth[g].dot(n.cast<float>());
      if (cosine < least) {
        least = cosine;
        region.worst = g;
      }
      for (int j = cells.first[g]; j < cells.first[g + 1]; ++j) {
        const int h = cells.neighbour[j];
        if (label[h] == p && mark[h] != stamp && !cone.inside(h, n)) {
          mark[h] = stamp;
          region.cells.push_back(h);
        }
      }
    }
    regions.push_back(std::move(region));
  }
  const double tolerance = cone.tolerance(patch_area);
  std::erase_if(regions, [&](const FoldedRegion& r) { return r.area <= tolerance; });
  return regions;
}

int split_folded(const NormalCone& cone, const Surface& surface, Patches& patches) {
  std::vector<int> mark(surface.faces.size(), -1);
  int cut = 0;
  // A face alone is always inside of its own cone, so this ends; ten rounds have never been needed.
  for (int round = 0; round < 1000; ++round) {
    const size_t count = patches.normal.size();
    const FaceLists lists = faces_by_patch(patches.label, count);
    std::vector<std::vector<FoldedRegion>> regions(count);
    tbb::parallel_for(size_t{0}, count, [&](size_t p) {
      const int i = static_cast<int>(p);
      regions[p] = folded_regions(cone, patches.label, i, lists.begin(i), lists.end(i), patches.normal[p],
                                  mark, round);
    });
    for (size_t p = 0; p < count; ++p)
      for (const FoldedRegion& r : regions[p]) {
        // A patch that is folded as a whole (its normals cancel out) is split by the direction of its worst
        // face.
        const bool whole = r.cells.size() == static_cast<size_t>(lists.size(static_cast<int>(p)));
        const Vec3 n = cone.cells.smooth[r.worst].cast<double>();
        const int fresh = static_cast<int>(patches.normal.size());
        const auto moves = [&](int f) { return !whole || cone.inside(f, n); };
        if (whole && std::all_of(r.cells.begin(), r.cells.end(), moves)) continue;
        for (int f : r.cells)
          if (moves(f)) patches.label[f] = fresh;
        patches.normal.push_back(n);
      }
    if (patches.normal.size() == count) break;
    cut += static_cast<int>(patches.normal.size() - count);
    refit(surface, patches);
  }
  return cut;
}

}  // namespace relief
