// Relief: encoder for dense surfaces. The C++ library behind `relief encode`.
//
// Method: Ochotta and Saupe, "Image-Based Surface Compression"; the files in src/ cite its sections.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace relief {

// The input is at fault. what() is one line that says what is wrong and where, without the file's name.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// An indexed triangle mesh, as read from a file, or without triangles a point cloud. Nothing is promised of it but
// what a reader checks: indices are in range and coordinates are finite.
struct TriangleMesh {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<std::array<float, 3>> normals;  // one a position, or empty
  std::vector<std::array<uint8_t, 4>> colors;  // sRGB red, green, blue, and opacity; one a position, or empty
};

// Called from the encoding thread: a stage's name and how much of the whole work is done, 0 to 1, never falling.
using Progress = std::function<void(const char* stage, double done)>;

// How coefficients are coded: by bands, which takes the fewest bytes; or by bit planes (3.5), so that the stream may be cut
// anywhere and each byte of a prefix counts.
enum class Coder { kSubband, kBisk };

// How bisk shares the bits of a prefix among patches (3.6): to where they lower the error most, or as many for each pixel.
enum class Allocation { kRateDistortion, kEven };

// How the surface is cut into patches (3.3): generalised Lloyd, which takes the fewest patches; or splitting and merging.
enum class Clustering { kLloyd, kSplitMerge };

// The normal of a patch's plane: the average of its normals (3.3); or the axis of the smallest cone around them (3.2).
enum class Plane { kAverage, kCone };

struct EncodeOptions {
  // The target. Exactly one of these is used: bytes if it is not zero, else bits_per_vertex if not zero, else error.
  double error = 1e-4;         // symmetric rms error (paper, equation 2) as a fraction of the bounding box diagonal
  uint64_t bytes = 0;          // bytes of the stream
  double bits_per_vertex = 0;  // bits of the stream per vertex of the input

  double aperture = 80;  // degrees; largest angle between a normal of a patch and its plane's normal (3.2)
  Clustering clustering = Clustering::kLloyd;
  Plane plane = Plane::kAverage;
  double density = 0;    // mu of 3.4: with 1 a patch has as many pixels as vertices, with 2 a quarter, to the nearest
                         // quarter power of two in spacing; 0: by rate-distortion, patch by patch (3.6)
  size_t min_component = 0;  // components of fewer triangles are dropped; 0: all are kept
  bool keep_handles = true;  // of meshes: also those smaller than the grid, at about 2 to 4 bytes each
  bool fit = true;           // least-squares fitting of elevations (4.1)
  Coder coder = Coder::kSubband;
  Allocation allocation = Allocation::kRateDistortion;  // of bisk
  int effort = 5;            // 1 .. 9: how much time goes into fewer bytes
  // Of inputs with colours: rms over red, green and blue of the vertices, levels of a byte; 0: without colours. Where
  // bytes are the target, colours take what the surface leaves of them.
  double color_error = 4;
  bool unquantised = false;  // also code the same patches with the finest step: tells the error of sampling
  Progress progress;     // may be empty
};

struct EncodeResult {
  std::vector<uint8_t> stream;
  std::vector<uint8_t> unquantised;  // as asked; else empty
  double color_error = 0;   // as EncodeOptions::color_error, of the vertices that are decoded
  size_t color_bytes = 0;   // of the stream; 0: it has no colours
  double error = 0;         // symmetric rms error measured on the decoded stream, fraction of the diagonal
  bool target_met = false;  // false: this is the closest that could be reached
  uint32_t patches = 0;
  std::vector<int> labels;             // the patch of each triangle of the input, or -1 if it was dropped
  std::vector<std::string> warnings;   // what was repaired or left out, a line each
  std::vector<std::pair<std::string, double>> seconds;  // time by stage
};

// Throws InputError if the mesh has no triangle of positive area.
EncodeResult encode(const TriangleMesh& mesh, const EncodeOptions& options);

struct DecodeOptions {
  uint64_t bytes = UINT64_MAX;  // of each stream, only the first so many are used: a coarser surface
  bool smooth = false;          // smooth the seams between patches (5.3; RELIEF_SMOOTH)
  bool points = false;          // vertices only, gaps left open (RELIEF_POINTS)
  uint32_t level = 0;           // a grid coarser by 2^level, 0 .. RELIEF_MAX_LEVEL
};

// Decodes with the library in decoder/. Throws InputError with the status' text, or if nothing is left at a level.
TriangleMesh decode(const uint8_t* data, size_t size, const DecodeOptions& options = {});

}  // namespace relief
