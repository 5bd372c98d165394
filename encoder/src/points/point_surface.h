// The surface of a point cloud (paper, section 3): what the encoder's parts, which walk over faces, work on.
//
// The paper partitions the points themselves and finds every height by projecting onto the MLS surface. Here
// the points are put on the MLS surface, where they are noisy, and triangulated there; partition, ownership,
// topology and masks then are those of meshes. The heights do not hang on the triangles where the points tell
// more than they do: between its corners a face then is curved as the MLS surface is, which the Newton-like
// iteration of 3.4 finds for the middle of each edge (Surface::bulge), once in place of once for each pixel
// of every grid that is tried. Whether they tell more, the points say: each is predicted from the others, by
// the polynomials and by planes. On scans the polynomials are hardly better (a third to a sixth of the
// error), and faces stay flat.
#pragma once
#include "points/mls.h"
#include "relief/encoder.h"

namespace relief {

class PointSurface {
 public:
  // Throws InputError if there are too few points for a surface.
  explicit PointSurface(const TriangleMesh& cloud);

  // Over the points without outliers; its orientation is that of the cloud's normals, if it has any.
  const TriangleMesh& mesh() const { return mesh_; }

  // Fills Surface::bulge of the surface built from mesh().
  void bulge(Surface& surface) const;

  const std::vector<std::string>& warnings() const { return warnings_; }
  double noise() const {
    return noise_;
  }  // rms distance of the points from the surface, in units of the model

  // The projection of a point in units of the model onto the MLS surface; side: a normal nearby.
  MlsPoint project(const Vec3& p, const Vec3& side) const { return mls_->project(p, side); }

  // The points that are left of the cloud, and their neighbourhoods.
  const Cloud& cloud() const { return cloud_; }
  const KdTree& tree() const { return *tree_; }

 private:
  void gather(const TriangleMesh& cloud);
  bool leave_out(const std::vector<char>& marked, const char* what);  // whether there were any
  void leave_out_the_lonely();
  void estimate_normals(bool given);
  void estimate_noise();
  void leave_out_the_wrong();
  Cloud resampled() const;

  Cloud cloud_;
  std::unique_ptr<KdTree> tree_;
  std::vector<double> reach_;  // of the MLS weights, at each point
  std::unique_ptr<MlsSurface> mls_;
  double noise_ = 0;
  bool noisy_ = false;   // points are moved onto the MLS surface
  bool smooth_ = false;  // its polynomials tell more than planes
  TriangleMesh mesh_;
  std::vector<std::string> warnings_;
};

// The surface in model units with every face cut in four at the middles of its edges, which lie as high as
// Surface::bulge says: what distances are measured from.
TriangleMesh curved_mesh(const Surface& surface);

}  // namespace relief
