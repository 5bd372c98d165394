// Which triangles close a face best (4.2): what they cost, and the cheapest of all triangulations of a small
// one.
#pragma once
#include "gap_state.h"

namespace relief {

constexpr uint32_t kBestFace = 12;  // corners up to which the best of all triangulations is found
constexpr int64_t kNoEar = INT64_MAX;

// The cheapest of all triangulations of a polygon of up to kBestFace corners (Klincsek 1980): best[i][j] is
// that of the part between corners i and j, split at corner at[i][j].
struct Triangulation {
  int64_t best[kBestFace][kBestFace];
  int32_t length[kBestFace][kBestFace];  // from corner to corner
  // of the triangle on the part's diagonal; zero where there is none
  int16_t normal[kBestFace][kBestFace][3];
  uint8_t at[kBestFace][kBestFace];
};

// Whether two nodes have an edge between them, or none may be made.
bool has_edge(const Gaps& g, uint32_t a, uint32_t b);

// The cost of cutting off corner b with neighbours a and c: a short new edge and a triangle that lies in the
// surface.
int64_t ear_cost(const Gaps& g, uint32_t a, uint32_t b, uint32_t c);

// q: the nodes at m corners, up to kBestFace. False if there is no triangulation.
bool find_triangulation(const Gaps& g, const uint32_t* q, uint32_t m, Triangulation& t);

// Which diagonal of a quad whose corners are different nodes is made, that from corner 0 or that from corner
// 1: what find_triangulation finds.
uint32_t diagonal_of_quad(const Gaps& g, const uint32_t* q);

}  // namespace relief
