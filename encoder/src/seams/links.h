// Which of the decoder's links between patches run along the surface, and which are missing.
#pragma once
#include <unordered_map>

#include "seams/decoded.h"
#include "surface/surface.h"

namespace relief {

// Where the vertices of the patches come from.
struct Ground {
  const Surface& surface;
  std::vector<Pixel> pixel;     // of each vertex that is a pixel
  std::vector<int> face;        // of the surface, likewise
  std::vector<double> spacing;  // of its patch's grid, lattice units

  Vec3 lattice(const std::array<float, 3>& p) const {
    return (Vec3(p[0], p[1], p[2]) - surface.origin) / surface.scale;
  }
};
Ground ground_of(const Surface& surface, const std::vector<CodedPatch>& patches, double spacing);

// Whether links are right, by their keys, so that none is looked at twice.
using KnownLinks = std::unordered_map<uint64_t, char>;

// Numbers of links whose ends the surface does not connect near the link, in ascending order.
std::vector<uint32_t> wrong_links(const DecodedMesh& decoded, const Ground& ground, KnownLinks& known);

// The connected parts of all patches, joined by the links but for `dropped`.
struct Pieces {
  std::vector<int> part;       // of each vertex that is a pixel
  std::vector<int> group;      // of each part: parts that links join
  std::vector<int> component;  // of each group: of the surface
  std::vector<size_t> pixels;  // of each group
  std::vector<int> main;       // of each component of the surface: its largest group, or -1
};
Pieces join_parts(const DecodedMesh& decoded, const Ground& ground, const std::vector<int>& part, int parts,
                  const std::vector<uint32_t>& dropped);

// A group of fewer pixels is left away where it cannot be joined to the others nearby.
constexpr size_t kStrayPixels = 64;

// The shortest links with which the groups of each component of the surface become one; sorted, with one link
// at most for each lower node.
std::vector<std::array<uint32_t, 2>> missing_links(const DecodedMesh& decoded, const Nodes& nodes,
                                                   const Ground& ground, const Pieces& pieces);

// Further links that run along the surface from these nodes, the shortest first, at most `most`: to nodes of
// other patches, or far along the border of the same one. None that the decoder knows of or that is in
// `added`, none with a lower node that `added` has.
std::vector<std::array<uint32_t, 2>> links_from(const DecodedMesh& decoded, const Ground& ground,
                                                const std::vector<uint32_t>& nodes,
                                                const std::vector<std::array<uint32_t, 2>>& added,
                                                size_t most);

}  // namespace relief
