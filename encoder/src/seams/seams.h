// What the encoder learns by decoding its own stream: which faces between patches are real holes of the
// surface, which links between patches are wrong or missing, and which pixels spoil the seams.
#pragma once
#include <unordered_set>

#include "measure/surface_error.h"
#include "measure/topology.h"
#include "resample/cliffs.h"
#include "seams/mask_edits.h"
#include "seams/masks.h"
#include "surface/border.h"
#include "surface/handle_places.h"

namespace relief {

// Of the surface and of what a stream decodes to, lattice units.
using SamplesWithSurface = std::function<MutualSamples(const TriangleMesh&)>;

// What was found out about triangles and links that many trials have.
struct Known {
  KnownTriangles triangles;
  KnownLinks links;
  std::unordered_set<uint64_t> vain_handles;  // links, by their pixels, that let no others in
};

struct SeamsInput {
  const Surface& surface;
  Topology topology;  // of the surface
  DistanceToSurface distance;
  SamplesWithSurface samples;
  const SurfaceBorder& border;
  const std::vector<Vec3>& folded;  // its vertices where it is folded
  int face_trials;                  // decodings, at most, to find links for the worst faces between patches
  const std::vector<HandlePlace>& handles;           // of the surface; empty: those that are lost stay so
  double target;                                     // error, lattice units; 0: none
  std::function<double(const TriangleMesh&)> error;  // of what a stream decodes to, likewise
  Known& known;
};

struct FoundSeams {
  Seams seams;
  TriangleMesh mesh;  // what the stream with these seams decodes to
  Topology topology;  // of that; components, boundary loops and genus only
  double error;       // of that, see add_steiner_points; 0: not known
  bool measured;      // else it is known about
};

// How much trouble is taken over seams: little; so much that it is known about what all of it would make of
// the error; all of it.
enum class Care { kLittle, kToAim, kAll };

// Finds the seams with which `parts` decodes to the surface: its holes open, its gaps closed, its handles
// made. To aim, tries links that one cannot be sure of, too, and adds Steiner points; with all care also
// tries holes likewise, leaves links out that fold, and adds tubes.
FoundSeams find_seams(const StreamParts& parts, const std::vector<CodedPatch>& patches,
                      const SeamsInput& input, Care care);

// So many times masks are looked at, at most, and so many times more where there are more than a few folds.
struct MendRounds {
  int rounds, for_folds;
};

// Decodes and takes out of the masks what spoils the seams, time and again, and puts back what did no good;
// then takes out what must not stay. See unwanted_pixels. Returns false if rounds for folds were left out
// that would do some good.
bool mend_masks(std::vector<CodedPatch>& patches, const StreamPlacement& placement, const SeamsInput& input,
                const MendRounds& most, std::vector<int>& patch_number, std::list<CleanedPatch>& storage,
                QuantisedImages& quantised);

}  // namespace relief
