#include "seams/seams.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "seams/attempt.h"
#include "seams/handles.h"
#include "seams/steiner_points.h"
#include "seams/tubes.h"
#include "seams/unfold.h"

namespace relief {
namespace {

constexpr int kMostTrials = 12;        // of holes
constexpr double kShareToLink = 0.03;  // of all error: faces that get links of their own
constexpr size_t kMostNewLinks = 8;
// With so much of all error in one face there may be so many times the trials.
constexpr double kDireShare = 0.15;
constexpr int kDireFactor = 4;

// A link or a face with how far it leaves the surface.
struct Suspect {
  float distance;
  uint32_t number;
};

void worst_first(std::vector<Suspect>& s) {
  std::sort(s.begin(), s.end(), [](const Suspect& a, const Suspect& b) {
    return a.distance != b.distance ? a.distance > b.distance : a.number < b.number;
  });
}

// Opens faces for the loops that have none yet, or closes such of several for one loop, as long as that
// brings the number of loops nearer. What lies along a loop with all of its nodes is tried first.
void adjust_holes(const SeamContext& in, Attempt& best) {
  Seams closed = best.seams;
  closed.holes.clear();
  std::vector<HoleFace> faces = hole_faces(in, attempt(in, std::move(closed)));
  std::stable_sort(faces.begin(), faces.end(), [](const HoleFace& a, const HoleFace& b) {
    return a.share != b.share ? a.share > b.share : a.distance > b.distance;
  });
  std::vector<int> open(in.border.loops.size(), 0);  // faces of each loop
  auto is_open = [&](const HoleFace& h) {
    return std::binary_search(best.seams.holes.begin(), best.seams.holes.end(), h.face);
  };
  for (const HoleFace& h : faces) open[size_t(h.loop)] += is_open(h);
  int trials = 0;
  auto try_all = [&](bool opening, auto begin, auto end) {
    for (auto h = begin; h != end && trials < kMostTrials; ++h) {
      const uint64_t is = best.topology.boundary_loops, should = in.topology.boundary_loops;
      int& count = open[size_t(h->loop)];
      if (opening ? is >= should || count > 0 : is <= should || count < 2 || !is_open(*h)) continue;
      Seams seams = best.seams;
      opening ? seams.holes.push_back(h->face) : void(std::erase(seams.holes, h->face));
      Attempt a = attempt(in, std::move(seams));
      trials++;
      if (a.mismatch >= best.mismatch) continue;
      best = std::move(a);
      count += opening ? 1 : -1;
    }
  };
  try_all(true, faces.begin(), faces.end());
  try_all(false, faces.rbegin(), faces.rend());
}

// Faces with more than so small a share of all error, the worst first.
std::vector<Suspect> worst_faces(const GapError& error) {
  std::vector<Suspect> faces;
  for (uint32_t f = 0; f < error.of_face.size(); f++)
    if (error.of_face[f] > kShareOfError * error.sum) faces.push_back({float(error.of_face[f]), f});
  worst_first(faces);
  return faces;
}

// The links at the nodes along a face's rim.
class RimLinks {
 public:
  explicit RimLinks(const SeamContext& in)
      : node_(in.ground.pixel.size(), UINT32_MAX), links_(in.plain.nodes.size()) {
    for (uint32_t n = 0; n < in.plain.nodes.size(); n++) node_[in.plain.nodes[n]] = n;
    for (uint32_t l = 0; l < in.plain.links.size(); l++)
      for (uint32_t n : in.plain.links[l]) links_[n].push_back(l);
  }
  // Those that are left out.
  std::vector<uint32_t> refused(const Attempt& a, uint32_t face) const {
    std::vector<uint32_t> found;
    for (size_t t = a.decoded.first_triangle[face]; t < a.decoded.face_end(face); t++)
      for (uint32_t v : a.decoded.mesh.triangles[t]) {
        if (v >= node_.size()) continue;
        for (uint32_t link : links_[node_[v]])
          if (a.decoded.kind[link] == LinkKind::kRefused) found.push_back(link);
      }
    return found;
  }
  // The nodes at the worst triangles of a face, each once.
  std::vector<uint32_t> worst_nodes(const Attempt& a, uint32_t face, const GapError& error) const {
    constexpr size_t kWorst = 3;
    const size_t first = a.decoded.patch_triangles();
    std::vector<Suspect> triangles;
    for (size_t t = a.decoded.first_triangle[face]; t < a.decoded.face_end(face); t++)
      triangles.push_back(
          {float(error.triangle[t - first].squared * error.triangle[t - first].area), uint32_t(t)});
    worst_first(triangles);
    triangles.resize(std::min(triangles.size(), kWorst));
    std::vector<uint32_t> found;
    for (const Suspect& s : triangles)
      for (uint32_t v : a.decoded.mesh.triangles[s.number])
        if (v < node_.size()) found.push_back(node_[v]);
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

 private:
  std::vector<uint32_t> node_;  // of each pixel
  std::vector<std::vector<uint32_t>> links_;
};

// Makes further handles, and adds links to the worst faces, as long as that takes triangles away that leave
// the surface: a handle that is missing leaves an opening closed. The worst faces first, by the links that
// were left out along their rims, then by new ones.
class FaceTrials {
 public:
  FaceTrials(const SeamContext& in, Attempt& best)
      : in_(in), best_(best), error_(error_of(in, best)), rims_(in), tried_(in.plain.links.size(), 0) {}

  void run() {
    while (improve_one()) {
    }
  }

 private:
  // Takes these seams if the error is lower, without laying surface bare and without a handle too many. link:
  // that must make a handle for it, or -1
  bool better_with(Seams seams, int64_t link) {
    trials_++;
    seams.holes.clear();
    Attempt a = open_holes(in_, std::move(seams));
    GapError e;
    const bool better = is_better(a, e, link);
    if (better) std::swap(best_, a), std::swap(error_, e);
    in_.spare = std::move(a.decoded);
    return better;
  }

  bool is_better(const Attempt& a, GapError& e, int64_t link) const {
    if (a.mismatch > best_.mismatch || a.topology.genus > in_.topology.genus) return false;
    if (link >= 0 && (a.decoded.kind[size_t(link)] != LinkKind::kMade || a.mismatch == best_.mismatch))
      return false;
    e = error_of(in_, a, error_);
    const double gain = error_.sum - e.sum;
    return gain > 0 && gain > laid_bare(best_.decoded, error_, a.decoded, e, in_.ground);
  }

  bool by_refused_links(uint32_t face) {
    for (uint32_t link : rims_.refused(best_, face)) {
      if (trials_ >= most_) return false;
      if (std::exchange(tried_[link], 1)) continue;
      Seams seams = best_.seams;
      seams.handles.push_back(link);
      if (better_with(std::move(seams), link)) return true;
    }
    return false;
  }

  bool by_new_links(uint32_t face) {
    for (const auto& link : links_from(best_.decoded, in_.ground, rims_.worst_nodes(best_, face, error_),
                                       best_.seams.added_links, kMostNewLinks)) {
      if (trials_ >= most_) return false;
      if (!tried_new_.insert(link).second) continue;
      Seams seams = best_.seams;
      seams.added_links.push_back(link);
      std::sort(seams.added_links.begin(), seams.added_links.end());
      if (better_with(std::move(seams), -1)) return true;
    }
    return false;
  }

  bool improve_one() {
    const std::vector<Suspect> faces = worst_faces(error_);
    const bool dire = !faces.empty() && faces[0].distance > kDireShare * error_.sum;
    most_ = in_.face_trials * (dire ? kDireFactor : 1);
    for (const Suspect& face : faces) {
      if (by_refused_links(face.number)) return true;
      if (face.distance > kShareToLink * error_.sum && by_new_links(face.number)) return true;
    }
    return false;
  }

  const SeamContext& in_;
  Attempt& best_;
  GapError error_;
  const RimLinks rims_;
  std::vector<char> tried_;  // of the decoder's links
  std::set<std::array<uint32_t, 2>> tried_new_;
  int trials_ = 0, most_ = 0;
};

}  // namespace

FoundSeams find_seams(const StreamParts& parts, const std::vector<CodedPatch>& patches,
                      const SeamsInput& input, Care care) {
  const SeamContext in(parts, decoded_patches(parts), patches, input);
  const std::vector<uint32_t> dropped = wrong_links(in.plain, in.ground, in.known.links);
  Attempt best = with_links(in, dropped, pieces_of(in, dropped));
  add_handles(in, best);
  if (care != Care::kLittle) FaceTrials(in, best).run();
  if (care == Care::kAll) {
    unfold(in, best);
    if (!in.closed()) adjust_holes(in, best);
    add_tubes(in, best);
  }
  SteinerError error;
  if (care != Care::kLittle) error = add_steiner_points(in, best, care == Care::kAll);
  return {std::move(best.seams), std::move(best.decoded.mesh), best.topology, error.error, error.measured};
}

}  // namespace relief
