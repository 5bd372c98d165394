#include "partition/connected.h"

#include <algorithm>
#include <iterator>
#include <tuple>

#include "surface/largest_first.h"

namespace relief {
namespace {

constexpr int kRounds = 8;

// The patch that the piece should join, or -1. Pieces that are adrift themselves do not count as neighbours.
int best_neighbour(const NormalCone& cone, const Surface& surface, const Patches& patches,
                   const std::vector<double>& patch_area, const std::vector<char>& adrift, const Piece& piece,
                   double epsilon) {
  std::vector<std::pair<int, double>> shared;  // patch, length of the common border
  for (int f : piece.faces)
    for (int k = 0; k < 3; ++k) {
      const int g = surface.adjacent[f][k];
      if (g < 0 || adrift[g] || patches.label[g] < 0) continue;
      const auto at = std::find_if(shared.begin(), shared.end(),
                                   [&](const auto& s) { return s.first == patches.label[g]; });
      if (at == shared.end())
        shared.emplace_back(patches.label[g], edge_length(surface, f, k));
      else
        at->second += edge_length(surface, f, k);
    }
  std::sort(shared.begin(), shared.end(), [](const auto& x, const auto& y) {
    return std::tie(y.second, x.first) < std::tie(x.second, y.first);
  });
  for (const auto& [p, length] : shared) {
    double outside = 0;
    for (int f : piece.faces)
      if (!cone.inside(f, patches.normal[p], epsilon)) outside += surface.areas[f];
    if (outside <= cone.tolerance(patch_area[p] + piece.area)) return p;
  }
  return -1;
}

Piece piece_at(const Surface& surface, const std::vector<int>& label, int start, std::vector<char>& seen) {
  Piece piece{label[start], 0, {start}};
  seen[start] = 1;
  for (size_t i = 0; i < piece.faces.size(); ++i) {
    piece.area += surface.areas[piece.faces[i]];
    for (int g : surface.adjacent[piece.faces[i]])
      if (g >= 0 && !seen[g] && label[g] == piece.patch) {
        seen[g] = 1;
        piece.faces.push_back(g);
      }
  }
  return piece;
}

}  // namespace

std::vector<Piece> pieces_of(const Surface& surface, const std::vector<int>& label) {
  const size_t patches = 1 + static_cast<size_t>(std::max(0, *std::max_element(label.begin(), label.end())));
  const FaceLists lists = faces_by_patch(label, patches);
  std::vector<std::vector<Piece>> of_patch(patches);
  std::vector<char> seen(label.size(), 0);
  const auto size = [&](size_t p) { return lists.size(static_cast<int>(p)); };
  largest_first(patches, size, [&](size_t p) {
    for (const int* f = lists.begin(p); f != lists.end(p); ++f)
      if (!seen[*f]) of_patch[p].push_back(piece_at(surface, label, *f, seen));
  });
  std::vector<Piece> pieces;
  for (auto& of : of_patch) std::move(of.begin(), of.end(), std::back_inserter(pieces));
  std::sort(pieces.begin(), pieces.end(),
            [](const Piece& a, const Piece& b) { return a.faces[0] < b.faces[0]; });
  return pieces;
}

int connect_patches(const NormalCone& cone, const Surface& surface, Patches& patches, double epsilon) {
  std::vector<Piece> pieces = pieces_of(surface, patches.label);
  std::vector<int> main(patches.normal.size(), -1);
  std::vector<double> patch_area(patches.normal.size(), 0);
  for (size_t i = 0; i < pieces.size(); ++i) {
    int& m = main[pieces[i].patch];
    if (m < 0 || pieces[i].area > pieces[m].area) m = static_cast<int>(i);
    patch_area[pieces[i].patch] += pieces[i].area;
  }
  std::vector<char> adrift(patches.label.size(), 0);
  std::vector<int> waiting;
  for (size_t i = 0; i < pieces.size(); ++i) {
    if (main[pieces[i].patch] == static_cast<int>(i)) continue;
    waiting.push_back(static_cast<int>(i));
    for (int f : pieces[i].faces) adrift[f] = 1;
  }
  const int moved = static_cast<int>(waiting.size());
  // A piece may be joined to one that was joined in the round before.
  for (int round = 0; round < kRounds && !waiting.empty(); ++round)
    std::erase_if(waiting, [&](int i) {
      const int p = best_neighbour(cone, surface, patches, patch_area, adrift, pieces[i], epsilon);
      if (p < 0) return false;
      patch_area[p] += pieces[i].area;
      for (int f : pieces[i].faces) {
        patches.label[f] = p;
        adrift[f] = 0;
      }
      return true;
    });
  for (int i : waiting) {
    for (int f : pieces[i].faces) patches.label[f] = static_cast<int>(patches.normal.size());
    patches.normal.push_back(cone.cells.smooth[pieces[i].faces[0]].cast<double>());
  }
  refit(surface, patches);
  compact(patches);
  return moved;
}

}  // namespace relief
