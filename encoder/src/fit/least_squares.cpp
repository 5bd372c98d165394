#include "fit/least_squares.h"

#include <Eigen/Core>

#include "resample/cells.h"

namespace relief {
namespace {

constexpr float kRingWeight = 0.3f;  // of points that other patches own
constexpr float kPull = 0.05f;       // to the sampled elevation
constexpr int kSteps = 12;           // of conjugate gradients; 3 come close already

using Vector = Eigen::VectorXf;

// The normal equations A'A x = A'b. A pixel is coupled with its right, lower, and both diagonal neighbours
// below.
struct NormalEquations {
  Eigen::Index w;
  Vector centre, right, down, main, anti, b;

  NormalEquations(Eigen::Index width, Eigen::Index n)
      : w(width),
        centre(Vector::Zero(n)),
        right(centre),
        down(centre),
        main(centre),
        anti(centre),
        b(centre) {}

  void add(Eigen::Index i, const Shares& s, float z, float weight) {
    const float a = s.a * weight, c = s.c * weight, d = s.d * weight, e = s.b * weight;
    centre[i] += a * s.a, centre[i + 1] += e * s.b, centre[i + w] += c * s.c, centre[i + w + 1] += d * s.d;
    right[i] += a * s.b, right[i + w] += c * s.d;
    down[i] += a * s.c, down[i + 1] += e * s.d;
    main[i] += a * s.d;
    anti[i + 1] += e * s.c;  // from (x+1, y) to (x, y+1)
    b[i] += a * z, b[i + 1] += e * z, b[i + w] += c * z, b[i + w + 1] += d * z;
  }

  Vector times(const Vector& x) const {
    const Eigen::Index n = x.size();
    Vector r = centre.cwiseProduct(x);
    auto couple = [&](const Vector& k, Eigen::Index offset) {
      const Eigen::Index m = n - offset;
      r.head(m) += k.head(m).cwiseProduct(x.tail(m));
      r.tail(m) += k.head(m).cwiseProduct(x.head(m));
    };
    couple(right, 1);
    couple(down, w);
    couple(main, w + 1);
    couple(anti, w - 1);
    return r;
  }
};

}  // namespace

void fit_elevations(ElevationMap& map, const FineRaster& fine) {
  if (map.pixels == 0 || map.width < 3) return;
  const Eigen::Index n = Eigen::Index(map.z.size());
  NormalEquations m(map.width, n);
  const std::vector<Cell> cells = cells_of(map);
  each_sample(map, fine, cells, [&](size_t i, const Shares& s, size_t j) {
    if (s.covered) m.add(Eigen::Index(i), s, fine.z[j], fine.owner[j] == 1 ? 1.0f : kRingWeight);
  });
  Vector x(n), free(n);
  for (Eigen::Index i = 0; i < n; i++) {
    free[i] = map.mask[size_t(i)] ? 1.0f : 0.0f;
    x[i] = map.mask[size_t(i)] ? map.z[size_t(i)] : 0.0f;
  }
  m.centre.array() += kPull;
  m.b += kPull * x;
  Vector r = (m.b - m.times(x)).cwiseProduct(free), p = r;
  float rr = r.squaredNorm();
  for (int step = 0; step < kSteps && rr > 1e-9f; step++) {
    const Vector q = m.times(p).cwiseProduct(free);
    const float alpha = rr / p.dot(q);
    x += alpha * p;
    r -= alpha * q;
    const float next = r.squaredNorm();
    p = r + (next / rr) * p;
    rr = next;
  }
  for (Eigen::Index i = 0; i < n; i++)
    if (map.mask[size_t(i)]) map.z[size_t(i)] = x[i];
}

}  // namespace relief
