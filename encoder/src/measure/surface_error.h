// The symmetric rms surface error (paper, 3.1, equations 1 and 2), L-infinity and PSNR.
#pragma once
#include <Eigen/Core>
#include <memory>

#include "relief/encoder.h"

namespace relief {

struct SurfaceError {             // distances in the units of the meshes; a is the original
  double rms_ab = 0, rms_ba = 0;  // one-sided: samples of a to b, samples of b to a
  double max_ab = 0, max_ba = 0;
  double rms = 0, max = 0;                 // the larger of both
  double rms_deviation = 0;                // standard deviation of rms over sets of samples
  double diagonal = 0;                     // of a's bounding box, over all of its positions
  double psnr = 0;                         // 20 log10(diagonal / rms), dB
  double normal_mean = 0, normal_p99 = 0;  // degrees between face normals at a sample and its closest point
};

// Points spread over two surfaces, with their distances to one another.
struct MutualSamples {
  struct Sample {
    Eigen::Vector3d point;
    uint32_t triangle;  // of the mesh that is not the original: the closest one, or the point's own
    double square;      // squared distance to the other surface
    double area;        // that it stands for
  };
  std::vector<Sample> of_original, of_other;
};

// A mesh prepared to be measured against many others: keeps the search structure of the original.
class ErrorMeter {
 public:
  // samples: on each side, more of them where the surfaces are far apart.
  ErrorMeter(const TriangleMesh& original, size_t samples);
  ~ErrorMeter();
  SurfaceError measure(const TriangleMesh& other) const;
  // Only SurfaceError::rms over the diagonal, for meshes that are much alike, one after the other: where the
  // original has its samples is decided once, and again where they err too much.
  double relative_rms(const TriangleMesh& other);
  // Only SurfaceError::rms_ab over the diagonal, likewise. share: one in so many of the samples is taken.
  double relative_rms_from_original(const TriangleMesh& other, size_t share);
  // What relative_rms goes by.
  MutualSamples samples(const TriangleMesh& other);
  // distance of every position of `other` (if_positions) to the original surface, in units of the mesh
  std::vector<float> distance_of_positions(const TriangleMesh& other) const;
  // the triangle of the original that is closest to each position
  std::vector<uint32_t> closest_triangles(const std::vector<std::array<float, 3>>& positions) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relief
