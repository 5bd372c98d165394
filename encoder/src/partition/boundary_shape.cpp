#include "partition/boundary_shape.h"

#include <algorithm>
#include <queue>
#include <tuple>

namespace relief {
namespace {

// Moves `face`, and `second` unless it is -1, to patch `to`.
struct Move {
  double decrease;
  int face, second, to;
  // The queue yields the largest first; ties are broken by numbers, for the same result everywhere.
  bool operator<(const Move& o) const {
    return std::tie(decrease, o.face, o.second, o.to) < std::tie(o.decrease, face, second, to);
  }
};

class BoundaryShape {
 public:
  BoundaryShape(const NormalCone& cone, const Surface& surface, Patches& patches, double epsilon)
      : cone_(cone), surface_(surface), patches_(patches), label_(patches.label), epsilon_(epsilon) {
    // Smaller decreases would be rounding errors.
    least_ = 1e-9 * std::sqrt(surface_.total_area);
  }
  double run();

 private:
  void propose(int face);
  void propose(int face, int second, int to);
  double decrease(int face, int second, int to) const;
  bool allowed(const Move& move) const;
  bool stays_connected(int face, int second) const;
  bool fan_connects(int v, int first, int last, int face, int second) const;

  const NormalCone& cone_;
  const Surface& surface_;
  Patches& patches_;
  std::vector<int>& label_;
  double epsilon_, least_;
  std::priority_queue<Move> queue_;
};

// By how much the boundary gets shorter: edges towards `to` vanish, edges towards the old patch appear.
double BoundaryShape::decrease(int face, int second, int to) const {
  double sum = 0;
  for (int f : {face, second}) {
    if (f < 0) continue;
    for (int k = 0; k < 3; ++k) {
      const int g = surface_.adjacent[f][k];
      if (g < 0 || g == face || g == second) continue;
      if (label_[g] == to) sum += edge_length(surface_, f, k);
      if (label_[g] == label_[face]) sum -= edge_length(surface_, f, k);
    }
  }
  return sum;
}

// True if the patch's faces around vertex v lead from face `first` to face `last` without `face` and
// `second`.
bool BoundaryShape::fan_connects(int v, int first, int last, int face, int second) const {
  int at = first, from = face;
  if (std::find(surface_.adjacent[first].begin(), surface_.adjacent[first].end(), face) ==
      surface_.adjacent[first].end())
    from = second;
  for (int steps = 0; steps < 100; ++steps) {
    if (at == last) return true;
    int next = -1;
    for (int k = 0; k < 3; ++k) {
      const auto& t = surface_.faces[at];
      const int g = surface_.adjacent[at][k];
      if (g >= 0 && g != from && (t[k] == v || t[(k + 1) % 3] == v)) next = g;
    }
    if (next < 0 || next == face || next == second || label_[next] != label_[face]) return false;
    from = at;
    at = next;
  }
  return false;
}

// A sufficient condition: at most one neighbour of the moving faces remains in the old patch, or two that the
// patch's faces around a common vertex connect. (More cannot occur: three edges of a quadrangle are longer
// than the fourth.)
bool BoundaryShape::stays_connected(int face, int second) const {
  int face_of[6], edge_of[6], count = 0;
  for (int f : {face, second}) {
    if (f < 0) continue;
    for (int k = 0; k < 3; ++k) {
      const int g = surface_.adjacent[f][k];
      if (g < 0 || g == face || g == second || label_[g] != label_[face]) continue;
      face_of[count] = f;
      edge_of[count++] = k;
    }
  }
  if (count <= 1) return true;
  if (count > 2) return false;
  const int a = surface_.adjacent[face_of[0]][edge_of[0]], b = surface_.adjacent[face_of[1]][edge_of[1]];
  if (a == b) return true;
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) {
      const int v = surface_.faces[face_of[0]][(edge_of[0] + i) % 3];
      if (v == surface_.faces[face_of[1]][(edge_of[1] + j) % 3] && fan_connects(v, a, b, face, second))
        return true;
    }
  return false;
}

bool BoundaryShape::allowed(const Move& move) const {
  const Vec3& n = patches_.normal[move.to];
  return cone_.inside(move.face, n, epsilon_) &&
         (move.second < 0 || cone_.inside(move.second, n, epsilon_)) &&
         stays_connected(move.face, move.second);
}

void BoundaryShape::propose(int face, int second, int to) {
  const double d = decrease(face, second, to);
  if (d > least_) queue_.push({d, face, second, to});
}

// All moves of the face alone and with a neighbour of the same patch.
void BoundaryShape::propose(int face) {
  const auto to_neighbours_of = [&](int f, int a, int b) {
    for (int g : surface_.adjacent[f])
      if (g >= 0 && label_[g] != label_[f]) propose(a, b, label_[g]);
  };
  to_neighbours_of(face, face, -1);
  for (int g : surface_.adjacent[face])
    if (g >= 0 && label_[g] == label_[face]) {
      to_neighbours_of(face, std::min(face, g), std::max(face, g));
      to_neighbours_of(g, std::min(face, g), std::max(face, g));
    }
}

double BoundaryShape::run() {
  for (size_t f = 0; f < label_.size(); ++f) {
    const auto& adjacent = surface_.adjacent[f];
    if (std::any_of(adjacent.begin(), adjacent.end(),
                    [&](int g) { return g >= 0 && label_[g] != label_[f]; }))
      propose(static_cast<int>(f));
  }
  double sum = 0;
  while (!queue_.empty()) {
    const Move move = queue_.top();
    queue_.pop();
    // A move may be out of date; its successor, if any, was proposed when the neighbourhood changed.
    if (label_[move.face] == move.to || (move.second >= 0 && label_[move.second] != label_[move.face]))
      continue;
    if (decrease(move.face, move.second, move.to) != move.decrease || !allowed(move)) continue;
    label_[move.face] = move.to;
    if (move.second >= 0) label_[move.second] = move.to;
    sum += move.decrease;
    for (int f : {move.face, move.second}) {
      if (f < 0) continue;
      propose(f);
      for (int g : surface_.adjacent[f])
        if (g >= 0) propose(g);
    }
  }
  return sum;
}

}  // namespace

double optimize_boundary_shape(const NormalCone& cone, const Surface& surface, Patches& patches,
                               double epsilon) {
  const double sum = BoundaryShape(cone, surface, patches, epsilon).run();
  refit(surface, patches);
  compact(patches);
  return sum;
}

}  // namespace relief
