// An attempt to close the gaps of some patches: seams, and what the decoder makes of them.
#pragma once
#include "seams/borders.h"
#include "seams/gap_error.h"
#include "seams/holes.h"
#include "seams/seams.h"

namespace relief {

// All that decides what a stream decodes to but the seams.
struct SeamContext : SeamsInput {
  const StreamParts& coded;
  Ground ground;
  mutable PatchDecoder decoder;
  mutable DecodedMesh spare;  // of an attempt that was given up
  DecodedMesh plain;          // without seams
  Borders borders;
  std::vector<int> part;  // of each pixel: the connected part of a patch
  int parts = 0;

  // decoder: of these patches
  SeamContext(const StreamParts& coded, PatchDecoder decoder, const std::vector<CodedPatch>& patches,
              const SeamsInput& input);
  bool closed() const { return border.loops.empty(); }
};

// Of the stream with these parts.
PatchDecoder decoded_patches(const StreamParts& parts);

struct Attempt {
  Seams seams;
  DecodedMesh decoded;
  Topology topology;
  double mismatch = 0;  // how far that is from the surface's: pieces and loops count more than handles
};
Attempt attempt(const SeamContext& in, Seams seams);

// With these links, and every face open that is clearly a hole.
Attempt open_holes(const SeamContext& in, Seams links);

// With these links dropped, and the missing ones added.
Attempt with_links(const SeamContext& in, std::vector<uint32_t> dropped, const Pieces& pieces);

Pieces pieces_of(const SeamContext& in, const std::vector<uint32_t>& dropped);

// like: of an attempt that is much the same; only saves time.
GapError error_of(const SeamContext& in, const Attempt& a, const GapError& like = {});
std::vector<HoleFace> hole_faces(const SeamContext& in, const Attempt& filled);

}  // namespace relief
