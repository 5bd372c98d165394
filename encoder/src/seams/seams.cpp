#include "seams/seams.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "seams/borders.h"
#include "seams/gap_error.h"
#include "seams/holes.h"

namespace relief {
namespace {

// A face along the surface's border is a hole where its triangles' middles leave the surface by so many grid
// spacings.
constexpr float kHole = 1.0f;
constexpr int kMostTrials = 12;
// Links that are left out across a handle that is not made, at least: fewer cross their neighbours.
constexpr size_t kFewLinks = 4;
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

// All that decides what a stream decodes to but the seams.
struct Context : SeamsInput {
  const StreamParts& coded;
  Ground ground;
  mutable PatchDecoder decoder;
  mutable DecodedMesh spare;  // of an attempt that was given up
  DecodedMesh plain;          // without seams
  Borders borders;
  std::vector<int> part;  // of each pixel: the connected part of a patch
  int parts = 0;
  KnownTriangles& known;
  Context(const StreamParts& p, const std::vector<CodedPatch>& patches, const SeamsInput& in,
          KnownTriangles& k)
      : SeamsInput(in),
        coded(p),
        ground(ground_of(in.surface, patches, p.placement.spacing)),
        decoder(assemble(p, {p.boundary_nodes, 0, 0}, {})),
        plain(decoder.close({})),
        borders(plain),
        known(k) {
    part = connected_parts(plain.mesh, plain.patch_triangles(), parts);
    part.resize(ground.pixel.size());
  }
  bool closed() const { return border.loops.empty(); }
};

// How far a topology is from the surface's: pieces and loops count more than handles.
double mismatch(const Topology& is, const Topology& should) {
  auto difference = [](double a, double b) { return std::abs(a - b); };
  return 3 * difference(double(is.components), double(should.components)) +
         2 * difference(double(is.boundary_loops), double(should.boundary_loops)) +
         difference(double(is.genus), double(should.genus));
}

struct Attempt {
  Seams seams;
  DecodedMesh decoded;
  Topology topology;
  double mismatch = 0;
};

// All that find_seams compares. Every vertex is used, and the decoder makes nothing but manifolds.
Topology topology_of(const Context& in, const DecodedMesh& d) {
  const Borders::Count border = in.closed() ? Borders::Count{} : in.borders.count(d);
  const uint64_t faces = d.mesh.triangles.size(), edges = (3 * faces + border.edges) / 2;
  Topology t;
  t.components = uint64_t(join_across_gaps(d, in.part, in.parts, nullptr));
  t.boundary_loops = border.loops;
  t.euler = int64_t(d.mesh.positions.size()) - int64_t(edges) + int64_t(faces);
  t.genus = (2 * int64_t(t.components) - t.euler - int64_t(t.boundary_loops)) / 2;
  return t;
}

Attempt attempt(const Context& in, Seams seams) {
  Attempt a;
  std::sort(seams.dropped_links.begin(), seams.dropped_links.end());
  std::sort(seams.holes.begin(), seams.holes.end());
  a.decoded = in.decoder.close(seams, std::exchange(in.spare, {}));
  a.topology = topology_of(in, a.decoded);
  a.mismatch = mismatch(a.topology, in.topology);
  a.seams = std::move(seams);
  return a;
}

GapError error_of(const Context& in, const Attempt& a, const GapError& like = {}) {
  return gap_error(a.decoded, in.ground, in.distance, in.coded.placement.spacing, like, in.known);
}

std::vector<HoleFace> hole_faces(const Context& in, const Attempt& filled) {
  return faces_along_border(filled.decoded, in.ground, in.border, error_of(in, filled),
                            in.coded.placement.spacing);
}

// With these links, and every face open that is clearly a hole.
Attempt open_holes(const Context& in, Seams links) {
  std::sort(links.handles.begin(), links.handles.end());
  Attempt filled = attempt(in, std::move(links));
  if (in.closed()) return filled;
  Seams seams = filled.seams;
  for (const HoleFace& hole : hole_faces(in, filled))
    if (hole.distance > kHole) seams.holes.push_back(hole.face);
  return seams.holes.empty() ? filled : attempt(in, std::move(seams));
}

// With these links dropped, and the missing ones added.
Attempt with_links(const Context& in, std::vector<uint32_t> dropped, const Pieces& pieces) {
  return open_holes(
      in, {std::move(dropped), {}, missing_links(in.plain, in.decoder.open().nodes, in.ground, pieces), {}});
}

Pieces pieces_of(const Context& in, const std::vector<uint32_t>& dropped) {
  return join_parts(in.plain, in.ground, in.part, in.parts, dropped);
}

// Opens faces for the loops that have none yet, or closes such of several for one loop, as long as that
// brings the number of loops nearer. What lies along a loop with all of its nodes is tried first.
void adjust_holes(const Context& in, Attempt& best) {
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

// Links that were left out although they run along the surface, in groups of neighbours, without those that
// `vain` tells of. The largest group first.
std::vector<std::vector<uint32_t>> missing_handles(const Context& in, const Attempt& a,
                                                   const std::vector<char>& vain) {
  std::vector<std::vector<uint32_t>> groups;
  std::vector<Vec3> last;
  const double near = 4 * in.coded.placement.spacing;
  for (uint32_t link = 0; link < a.decoded.links.size(); link++) {
    if (a.decoded.kind[link] != LinkKind::kRefused || vain[link]) continue;
    const auto& [u, v] = a.decoded.links[link];
    const Vec3 p = (in.ground.lattice(a.decoded.mesh.positions[a.decoded.nodes[u]]) +
                    in.ground.lattice(a.decoded.mesh.positions[a.decoded.nodes[v]])) /
                   2;
    size_t k = 0;
    while (k < groups.size() && (last[k] - p).norm() >= near) k++;
    if (k == groups.size()) groups.emplace_back(), last.emplace_back();
    groups[k].push_back(link);
    last[k] = p;
  }
  std::erase_if(groups, [](auto& g) { return g.size() < kFewLinks; });
  std::stable_sort(groups.begin(), groups.end(), [](auto& x, auto& y) { return x.size() > y.size(); });
  return groups;
}

// Makes the handles of the surface. One that is not made leaves out all links across a gap: where a group of
// neighbours was left out, one of them may make a handle. That was right if most of the others are let in
// after it.
void add_handles(const Context& in, Attempt& best) {
  std::vector<char> vain(in.plain.links.size(), 0);
  auto with_handles = [&](std::vector<uint32_t> handles) {
    return open_holes(in, {best.seams.dropped_links, std::move(handles), best.seams.added_links, {}});
  };
  for (int trial = 0; trial < kMostTrials && best.topology.genus < in.topology.genus; trial++) {
    std::vector<std::vector<uint32_t>> groups = missing_handles(in, best, vain);
    groups.resize(std::min(groups.size(), size_t(in.topology.genus - best.topology.genus)));
    if (groups.empty()) return;
    std::vector<uint32_t> handles = best.seams.handles;
    for (const auto& group : groups) handles.push_back(group[group.size() / 2]);
    const Attempt tried = with_handles(handles);
    // those that made none were let in after another: they are in without being asked for
    std::erase_if(handles, [&](uint32_t link) { return tried.decoded.kind[link] != LinkKind::kMade; });
    const size_t made = handles.size();
    for (const auto& group : groups) {
      const auto left = std::count_if(group.begin(), group.end(), [&](uint32_t l) {
        return tried.decoded.kind[l] == LinkKind::kRefused;
      });
      if (size_t(left) * 2 <= group.size()) continue;
      std::erase(handles, group[group.size() / 2]);
      for (uint32_t link : group) vain[link] = 1;
    }
    const bool all = made == handles.size() && tried.seams.handles.size() == made;
    if (handles.size() <= best.seams.handles.size()) continue;
    Attempt a = all ? tried : with_handles(std::move(handles));
    if (a.mismatch >= best.mismatch) return;
    best = std::move(a);
  }
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
  explicit RimLinks(const Context& in)
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
  FaceTrials(const Context& in, Attempt& best)
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

  const Context& in_;
  Attempt& best_;
  GapError error_;
  const RimLinks rims_;
  std::vector<char> tried_;  // of the decoder's links
  std::set<std::array<uint32_t, 2>> tried_new_;
  int trials_ = 0, most_ = 0;
};

constexpr double kErrorScore = 0.05;  // spacings to the fourth that weigh as much as a pixel
constexpr int kVainRounds = 1;        // of mending masks, without getting better
constexpr int kNeedfulRounds = 2;     // after those, for what must not stay
constexpr double kCoincidentScore = 1000;

}  // namespace

FoundSeams find_seams(const StreamParts& parts, const std::vector<CodedPatch>& patches,
                      const SeamsInput& input, bool thorough) {
  KnownTriangles known;
  const Context in(parts, patches, input, known);
  const std::vector<uint32_t> dropped = wrong_links(in.plain, in.ground);
  Attempt best = with_links(in, dropped, pieces_of(in, dropped));
  add_handles(in, best);
  FaceTrials(in, best).run();
  if (thorough && !in.closed()) adjust_holes(in, best);
  return {std::move(best.seams), std::move(best.decoded.mesh), best.topology};
}

void mend_masks(std::vector<CodedPatch>& patches, const StreamPlacement& placement, const SeamsInput& input,
                int rounds, std::vector<int>& patch_number, std::list<CleanedPatch>& storage,
                QuantisedImages& quantised) {
  struct State {
    std::vector<CodedPatch> patches;
    std::vector<int> patch_number;
    double score;
  } best = {{}, {}, INFINITY};
  StreamParts parts = code_stream(patches, placement, quantised);
  KnownTriangles known;
  MaskFaults faults;
  for (int round = 0, vain = 0, last = 0; last <= kNeedfulRounds; round++) {
    const bool needful = round >= rounds || vain > kVainRounds;
    last += needful;
    const Context in(parts, patches, input, known);
    const std::vector<uint32_t> dropped = wrong_links(in.plain, in.ground);
    const Pieces pieces = pieces_of(in, dropped);
    Attempt a = with_links(in, dropped, pieces);
    add_handles(in, a);
    const double lost_before = faults.lost;
    const GapError error = error_of(in, a);
    const std::vector<char> unwanted = unwanted_pixels(a.decoded, in.ground, pieces, error, needful, faults);
    const auto count = std::count(unwanted.begin(), unwanted.end(), 1);
    const double score = 10 * a.mismatch + 2 * faults.folds + double(count) +
                         kCoincidentScore * faults.coincident +
                         (error.sum + lost_before) / (kErrorScore * std::pow(double(placement.spacing), 4));
    if (score < best.score)
      best = {patches, patch_number, score}, vain = 0;
    else
      vain++;
    if (!remove_pixels(unwanted, patches, patch_number, storage)) break;
    parts = code_stream(patches, placement, quantised);
  }
  patches = std::move(best.patches);
  patch_number = std::move(best.patch_number);
}

}  // namespace relief
