#include "seams/unfold.h"

#include <algorithm>
#include <utility>

#include "seams/folds.h"

namespace relief {
namespace {

constexpr int kRounds = 8;
constexpr double kAllowed = 5e-4;  // of all error between patches: what a fold less may cost

// A link that is left out, with what lies around it before and after.
struct Without {
  uint32_t link;
  int region;
  int folds[2] = {0, 0};
  double error[2] = {0, 0};
};

class Unfolding {
 public:
  Unfolding(const SeamContext& in, Attempt& best)
      : in_(in),
        best_(best),
        finder_(in.plain, in.ground, in.folded),
        links_(in.ground.pixel.size()),
        tried_(in.plain.links.size(), 0) {
    for (uint32_t l = 0; l < in.plain.links.size(); l++)
      for (uint32_t node : in.plain.links[l]) links_[in.plain.nodes[node]].push_back(l);
  }

  void run() {
    folds_ = finder_.find(best_.decoded);
    if (!folds_.empty()) error_ = error_of(in_, best_);
    for (int round = 0; round < kRounds && !folds_.empty() && try_some(); round++) {
    }
  }

 private:
  // Leaves out a link at each of many folds that are apart. False: none is left to be tried.
  bool try_some() {
    std::vector<Without> trials = choose_trials();
    if (trials.empty()) return false;
    leave_out(std::move(trials));
    return true;
  }

  // Keeps those out that unfold. Where one of them harms the topology, each half of them is tried alone.
  void leave_out(std::vector<Without> trials) {
    Attempt a = without(trials);
    if (a.mismatch > best_.mismatch) {
      if (trials.size() == 1) return;
      const auto middle = trials.begin() + ptrdiff_t(trials.size() / 2);
      leave_out({trials.begin(), middle});
      leave_out({middle, trials.end()});
      return;
    }
    std::vector<Fold> folds = finder_.find(a.decoded);
    GapError error = error_of(in_, a, error_);
    count(best_, folds_, error_, 0, trials);
    count(a, folds, error, 1, trials);
    const size_t all = trials.size();
    std::erase_if(trials, [&](const Without& t) {
      return t.folds[1] >= t.folds[0] || t.error[1] > t.error[0] + kAllowed * error_.sum;
    });
    if (trials.empty()) return;
    if (trials.size() < all) {
      a = without(trials);
      folds = finder_.find(a.decoded);
      error = error_of(in_, a, error_);
    }
    if (a.mismatch > best_.mismatch || folds.size() >= folds_.size()) return;
    best_ = std::move(a), folds_ = std::move(folds), error_ = std::move(error);
  }

  Attempt without(const std::vector<Without>& trials) const {
    Seams seams = best_.seams;
    seams.holes.clear();
    for (const Without& t : trials) seams.dropped_links.push_back(t.link);
    return open_holes(in_, std::move(seams));
  }

  // A link for each fold, as long as what lies around them is apart: it is numbered in region_.
  std::vector<Without> choose_trials() {
    const DecodedMesh& d = best_.decoded;
    std::vector<std::vector<uint32_t>> faces(in_.ground.pixel.size());  // at each pixel
    for (uint32_t f = 0; f < d.first_triangle.size(); f++)
      for (size_t t = d.first_triangle[f]; t < d.face_end(f); t++)
        for (uint32_t v : d.mesh.triangles[t])
          if (v < faces.size() && (faces[v].empty() || faces[v].back() != f)) faces[v].push_back(f);
    region_.assign(in_.ground.pixel.size(), -1);
    std::vector<Without> trials;
    for (const Fold& fold : folds_) {
      std::vector<uint32_t> around;
      for (uint32_t t : fold.triangle)
        for (uint32_t v : d.mesh.triangles[t])
          if (v < faces.size())
            for (uint32_t f : faces[v])
              for (size_t u = d.first_triangle[f]; u < d.face_end(f); u++)
                for (uint32_t w : d.mesh.triangles[u])
                  if (w < faces.size()) around.push_back(w);
      if (std::any_of(around.begin(), around.end(), [&](uint32_t v) { return region_[v] >= 0; })) continue;
      const int64_t link = next_link(fold);
      if (link < 0) continue;
      for (uint32_t v : around) region_[v] = int(trials.size());
      trials.push_back({uint32_t(link), int(trials.size())});
      tried_[size_t(link)] = 1;
    }
    return trials;
  }

  // A link at a corner of the fold that was not tried yet; -1: there is none.
  int64_t next_link(const Fold& fold) const {
    for (uint32_t t : fold.triangle)
      for (uint32_t v : best_.decoded.mesh.triangles[t])
        if (v < links_.size())
          for (uint32_t link : links_[v])
            if (!tried_[link] && best_.decoded.kind[link] == LinkKind::kIn) return link;
    return -1;
  }

  // The region that a triangle lies in, or -1.
  int region_of(const std::array<uint32_t, 3>& triangle) const {
    int region = -1;
    for (uint32_t v : triangle) {
      if (v >= region_.size()) continue;
      if (region_[v] < 0 || (region >= 0 && region != region_[v])) return -1;
      region = region_[v];
    }
    return region;
  }

  void count(const Attempt& a, const std::vector<Fold>& folds, const GapError& error, int when,
             std::vector<Without>& trials) const {
    const std::vector<std::array<uint32_t, 3>>& triangles = a.decoded.mesh.triangles;
    auto at = [&](const std::array<uint32_t, 3>& triangle) {
      const int region = region_of(triangle);
      const auto t = std::lower_bound(trials.begin(), trials.end(), region,
                                      [](const Without& x, int r) { return x.region < r; });
      return t != trials.end() && t->region == region ? &*t : nullptr;
    };
    for (const Fold& f : folds)
      if (Without* t = at(triangles[f.triangle[0]])) t->folds[when]++;
    const size_t first = a.decoded.patch_triangles();
    for (size_t i = 0; i < error.triangle.size(); i++)
      if (Without* t = at(triangles[first + i]))
        t->error[when] += error.triangle[i].squared * error.triangle[i].area;
  }

  const SeamContext& in_;
  Attempt& best_;
  const FoldFinder finder_;
  std::vector<std::vector<uint32_t>> links_;  // at each pixel
  std::vector<char> tried_;                   // of the links
  std::vector<Fold> folds_;
  GapError error_;
  std::vector<int> region_;  // of each pixel: a trial's number, or -1
};

}  // namespace

void unfold(const SeamContext& in, Attempt& best) { Unfolding(in, best).run(); }

}  // namespace relief
