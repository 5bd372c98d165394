// The decoder with a view inside, for the encoder and for tests.
#pragma once
#include "container.h"
#include "gaps.h"
#include "relief/relief.h"

namespace relief {

// A stream decoded up to the gaps between its patches. Points into the mesh and the workspace.
struct OpenPatches {
  Parsed parsed;
  MeshWriter mesh;  // lattice coordinates
  Nodes nodes;
  bool whole;           // no patch is left out, nor missing
  uint32_t components;  // connected pieces of patches
  int32_t spacing;      // the largest, lattice units
  const PatchHeader* patches;
  const PlanesBegin* begin;  // of each patch's pyramid
  const uint8_t* mask;       // planes of the pyramids
  void* gap_memory;          // for close_gaps
};

// The first part of relief_decode. The encoder then closes the gaps with as many seams as it likes to try.
relief_status decode_patches(const void* data, size_t size, const relief_options* options, relief_mesh* mesh,
                             void* workspace, size_t workspace_size, OpenPatches& open);

// relief_decode with the leaves of a given level, for tests.
relief_status decode_with(const Leaves& leaves, const void* data, size_t size, const relief_options* options,
                          relief_mesh* mesh, void* workspace, size_t workspace_size);

// The stream's own seams; null if they are missing or cut.
const uint8_t* seams_of(const Parsed& parsed, const uint8_t* data);

// Lattice to model coordinates.
void place(const StreamHeader& header, float* positions, uint32_t count);

}  // namespace relief
