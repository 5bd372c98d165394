// Where the error of a decoded surface lies.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "relief/encoder.h"
#include "seams/decoded.h"

namespace relief {

// Distances are in 1e-4 of the diagonal; shares are of 1, E^2 being the mean squared distance of the samples.
struct ErrorLedger {
  struct Part {
    double area = 0, share = 0;  // of the decoded surface, of its E^2
    double rms = 0;              // of this part alone
  };
  struct Spot {
    std::array<double, 3> place{};  // of the farthest sample, in the coordinates of the model
    double farthest = 0, share = 0;
    bool gap = false;  // most of it is between patches
  };
  struct Side {
    double rms = 0, max = 0;
    double worst_100th = 0, worst_1000th = 0;  // share of E^2 of the worst samples
    std::vector<Spot> spots;                   // the ten with the largest shares
  };
  double diagonal = 0;
  Side to_original, to_decoded;  // samples of the decoded surface to the original, and the other way
  std::vector<Part> by_ring;     // as kRings
  std::vector<Part> by_patch;    // without gaps
};

// Parts of the decoded surface by how many triangles away the boundary of the patch is.
inline const std::vector<std::string> kRings = {"gaps",   "ring 0", "ring 1", "ring 2",
                                                "ring 3", "ring 4", "ring 5", "interior"};

// pixels: of each patch's mask, in the stream's order.
ErrorLedger read_error_ledger(const TriangleMesh& original, const DecodedMesh& decoded,
                              const std::vector<uint32_t>& pixels);

}  // namespace relief
