// Writing a stream.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "code/forward_wavelet.h"
#include "coefficients.h"
#include "format.h"

namespace relief {

// A patch that is ready to be coded.
struct CodedPatch {
  PatchHeader header;
  const uint8_t* mask;        // width * height
  const WaveletImage* image;  // of the elevations, without z0
  const float* z;             // the elevations; width * height
  const int* face;            // of the surface, that each pixel lies over; width * height
};

struct StreamPlacement {
  float origin[3];
  float scale;
  float spacing, step;  // of index 0, lattice units
  float trade;          // of quantisation by rate and distortion: squared steps a bit
  bool closed;          // the surface has no border
  bool bisk = false;    // coder: bisk, else subband
  // Of bisk only. Its finest bit plane is below `step`; the code is cut.
  bool even = false;             // allocate evenly (3.6, equation 5), else by rate and distortion
  size_t coefficient_bytes = 0;  // to cut it to; 0: to what a coder with `step` would think worth its bits
};

// Counts that only the decoder's result can tell; see StreamHeader.
struct StreamCounts {
  uint32_t boundary_nodes, vertices, triangles;
};

// A stream in parts, so that it can be decoded once before its counts and holes are known.
struct StreamParts {
  StreamPlacement placement;
  uint32_t patches = 0, mask_pixels = 0, boundary_nodes = 0;
  std::vector<uint8_t> table, coefficients;
  double table_bits = 0;              // of `table`, those before the masks
  size_t most_coefficient_bytes = 0;  // there were before the cut
};

// What images were quantised to: kept while other images change, to save the time and to leave what they
// decode to as it is.
class QuantisedImages {
 public:
  // The coefficients of an image for this step; empty if they are yet to be found.
  std::vector<int32_t>& of(const WaveletImage* image, float step) {
    Entry& e = images_[image];
    if (e.step != step) e = {step, {}};
    return e.q;
  }
  // Forgets images that are no more.
  void keep(const std::set<const WaveletImage*>& images) {
    std::erase_if(images_, [&](const auto& entry) { return images.count(entry.first) == 0; });
  }
  // What the coder's models were in the end when the images were coded last; null before that.
  std::unique_ptr<CoefficientModels> learned;

 private:
  struct Entry {
    float step = 0;
    std::vector<int32_t> q;
  };
  std::map<const WaveletImage*, Entry> images_;
};

// Quantises and codes images band by band, all images' LL first, then level by level. step: of each image.
// known: what is there already is taken as it is; what bits cost is told by what was learned then.
std::vector<uint8_t> code_images(const std::vector<const WaveletImage*>& images,
                                 const std::vector<float>& step, float trade, QuantisedImages& known);

// The step of a patch.
float step_of(const StreamPlacement& placement, const PatchHeader& patch);

// What code_stream does of that by subband, for patches that are not written but looked at: first it
// quantises images, then it learns from coding them all.
void quantise(const std::vector<CodedPatch>& patches, const StreamPlacement& placement,
              QuantisedImages& known);
void learn(const std::vector<CodedPatch>& patches, const StreamPlacement& placement, QuantisedImages& known);

void put_varint(std::vector<uint8_t>& out, uint32_t value);

StreamParts code_stream(const std::vector<CodedPatch>& patches, const StreamPlacement& placement,
                        QuantisedImages& known);

// Splits an edge of a triangle of gaps, numbered from the first of those, that it shares with one after it.
struct SteinerPoint {
  uint32_t triangle, edge;
  int32_t height;  // in kSteinerParts of the edge
};

// What only the decoder's result can tell: numbers in ascending order.
struct Seams {
  std::vector<uint32_t> dropped_links;               // links between patches that are wrong
  std::vector<uint32_t> handles;                     // links that may make a handle
  std::vector<std::array<uint32_t, 2>> added_links;  // nodes of links that are missing, the lower first
  std::vector<uint32_t> holes;                       // faces between patches that stay open
  std::vector<std::array<uint32_t, 2>> tubes;        // triangles of patches that one joins, the lower first
  std::vector<SteinerPoint> steiner_points;          // at most one of a triangle
};

// As the decoder reads them, see GapOptions. Empty lists at the end are left away.
std::vector<uint8_t> code_seams(const Seams& seams);

std::vector<uint8_t> assemble(const StreamParts& parts, const StreamCounts& counts, const Seams& seams);

// Border vertices of a clean mask, as the decoder counts them: pixels with an uncovered cell beside them.
uint32_t count_boundary_nodes(const uint8_t* mask, uint32_t width, uint32_t height);

}  // namespace relief
