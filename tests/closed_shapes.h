// Closed analytic surfaces of known genus, to try what an encoder can get wrong about topology: thin walls,
// folds, handles, surfaces near one another, sharp edges, many components.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "shapes.h"

namespace relief {

// The surface f = 0 inside of the box (f < 0 inside of the solid), from n cells along the box's longest side.
// Cells are cut into six tetrahedra around their diagonal, so the surface is a closed manifold if f > 0 on
// the box's rim.
inline TriangleMesh make_implicit(shapes::Point low, shapes::Point high, int n,
                                  const std::function<double(shapes::Point)>& f) {
  using Corner = std::array<int, 3>;
  const double cell = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]}) / n;
  Corner cells;
  for (int k = 0; k < 3; k++) cells[k] = int(std::ceil((high[k] - low[k]) / cell));
  auto place = [&](const Corner& c) {
    return shapes::Point{low[0] + cell * c[0], low[1] + cell * c[1], low[2] + cell * c[2]};
  };
  auto number = [&](const Corner& c) {
    return (size_t(c[2]) * size_t(cells[1] + 1) + size_t(c[1])) * size_t(cells[0] + 1) + size_t(c[0]);
  };
  std::vector<double> value(size_t(cells[0] + 1) * size_t(cells[1] + 1) * size_t(cells[2] + 1));
  for (int z = 0; z <= cells[2]; z++)
    for (int y = 0; y <= cells[1]; y++)
      for (int x = 0; x <= cells[0]; x++) value[number({x, y, z})] = f(place({x, y, z}));
  TriangleMesh mesh;
  std::map<std::pair<size_t, size_t>, uint32_t> made;
  auto cut = [&](const Corner& a, const Corner& b) {
    const size_t i = number(a), j = number(b);
    auto [it, fresh] = made.try_emplace(std::minmax(i, j), uint32_t(mesh.positions.size()));
    if (fresh) {
      // kept away from the ends, so that no triangle vanishes
      const double t = std::clamp(value[i] / (value[i] - value[j]), 0.02, 0.98);
      const shapes::Point p = place(a), q = place(b);
      shapes::add(mesh, {p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1]), p[2] + t * (q[2] - p[2])});
    }
    return it->second;
  };
  // Counter-clockwise seen from outside: from the mean of the corners outside.
  auto triangle = [&](uint32_t a, uint32_t b, uint32_t c, const shapes::Point& outward) {
    const auto &p = mesh.positions[a], &q = mesh.positions[b], &r = mesh.positions[c];
    double u[3], v[3];
    for (int k = 0; k < 3; k++)
      u[k] = double(q[size_t(k)]) - p[size_t(k)], v[k] = double(r[size_t(k)]) - p[size_t(k)];
    const double facing = (u[1] * v[2] - u[2] * v[1]) * outward[0] +
                          (u[2] * v[0] - u[0] * v[2]) * outward[1] + (u[0] * v[1] - u[1] * v[0]) * outward[2];
    mesh.triangles.push_back(facing > 0 ? std::array<uint32_t, 3>{a, b, c}
                                        : std::array<uint32_t, 3>{a, c, b});
  };
  auto tetrahedron = [&](const std::array<Corner, 4>& c) {
    std::vector<Corner> in, out;
    for (const Corner& k : c) (value[number(k)] < 0 ? in : out).push_back(k);
    if (in.empty() || out.empty()) return;
    shapes::Point outward = {0, 0, 0};
    for (size_t k = 0; k < 3; k++) {
      for (const Corner& i : in) outward[k] -= double(i[k]) / double(in.size());
      for (const Corner& o : out) outward[k] += double(o[k]) / double(out.size());
    }
    if (in.size() == 1) triangle(cut(in[0], out[0]), cut(in[0], out[1]), cut(in[0], out[2]), outward);
    if (in.size() == 3) triangle(cut(in[0], out[0]), cut(in[1], out[0]), cut(in[2], out[0]), outward);
    if (in.size() == 2) {
      triangle(cut(in[0], out[0]), cut(in[0], out[1]), cut(in[1], out[1]), outward);
      triangle(cut(in[0], out[0]), cut(in[1], out[1]), cut(in[1], out[0]), outward);
    }
  };
  int axes[3] = {0, 1, 2};
  for (int z = 0; z < cells[2]; z++)
    for (int y = 0; y < cells[1]; y++)
      for (int x = 0; x < cells[0]; x++) {
        std::sort(axes, axes + 3);
        do {  // along the cell's edges from its first corner to its last
          std::array<Corner, 4> c;
          c[0] = {x, y, z};
          for (int k = 0; k < 3; k++) c[size_t(k) + 1] = c[size_t(k)], c[size_t(k) + 1][size_t(axes[k])]++;
          tetrahedron(c);
        } while (std::next_permutation(axes, axes + 3));
      }
  return mesh;
}

// A closed tube of radius r around a closed curve, `along` times `around` quads.
inline TriangleMesh make_tube(int along, int around, double r,
                              const std::function<shapes::Point(double)>& curve) {
  using shapes::Point;
  auto minus = [](Point a, Point b) { return Point{a[0] - b[0], a[1] - b[1], a[2] - b[2]}; };
  auto cross = [](Point a, Point b) {
    return Point{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  auto unit = [](Point a) {
    const double n = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    return Point{a[0] / n, a[1] / n, a[2] / n};
  };
  TriangleMesh mesh;
  for (int i = 0; i < along; i++) {
    const double t = 2 * shapes::kPi * i / along, h = 1e-3;
    const Point c = curve(t), d = unit(minus(curve(t + h), curve(t - h)));
    // a frame that comes back to itself: the same rule at every t
    const Point out = unit(minus(c, {0, 0, 3}));
    const Point a = unit(cross(d, out)), b = cross(d, a);
    for (int j = 0; j < around; j++) {
      const double u = 2 * shapes::kPi * j / around, x = r * std::cos(u), y = r * std::sin(u);
      shapes::add(mesh, {c[0] + x * a[0] + y * b[0], c[1] + x * a[1] + y * b[1], c[2] + x * a[2] + y * b[2]});
    }
  }
  auto at = [=](int i, int j) { return uint32_t((i % along) * around + j % around); };
  for (int i = 0; i < along; i++)
    for (int j = 0; j < around; j++)
      shapes::add_quad(mesh, at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
  return flipped(mesh);
}

struct ClosedShape {
  std::string name;
  std::function<TriangleMesh()> make;
  int components, genus;
};

namespace shapes {

inline double length(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }

// A slab with `holes` drilled through, nx by ny of them.
inline TriangleMesh make_drilled(int nx, int ny, double thickness, double radius, int n) {
  const double w = nx * 1.0, h = ny * 1.0;
  return make_implicit(
      {-w / 2 - 0.2, -h / 2 - 0.2, -thickness}, {w / 2 + 0.2, h / 2 + 0.2, thickness}, n, [=](Point p) {
        const double box =
            std::max({std::fabs(p[0]) - w / 2, std::fabs(p[1]) - h / 2, std::fabs(p[2]) - thickness / 2});
        double solid = box;
        for (int i = 0; i < nx; i++)
          for (int j = 0; j < ny; j++) {
            const double x = p[0] - (i - (nx - 1) / 2.0), y = p[1] - (j - (ny - 1) / 2.0);
            solid = std::max(solid, radius - std::sqrt(x * x + y * y));
          }
        return solid;
      });
}

inline TriangleMesh make_double_torus(int n) {
  return make_implicit({-2.5, -1.5, -0.6}, {2.5, 1.5, 0.6}, n, [](Point p) {
    auto ring = [&](double x) {
      return length(std::sqrt((p[0] - x) * (p[0] - x) + p[1] * p[1]) - 0.9, p[2], 0) - 0.3;
    };
    const double a = ring(-0.95), b = ring(0.95), k = 0.2;  // a smooth union
    const double h = std::clamp(0.5 + 0.5 * (b - a) / k, 0.0, 1.0);
    return b + (a - b) * h - k * h * (1 - h);
  });
}

// A ball with cavities inside, and tunnels through it along the three axes that do not meet: genus 3.
inline TriangleMesh make_cheese(int n) {
  return make_implicit({-1.1, -1.1, -1.1}, {1.1, 1.1, 1.1}, n, [](Point p) {
    double solid = length(p[0], p[1], p[2]) - 1;
    solid = std::max(solid, 0.14 - length(p[0] - 0.45, p[1], 0));
    solid = std::max(solid, 0.14 - length(p[1] - 0.45, p[2], 0));
    solid = std::max(solid, 0.14 - length(p[2] - 0.45, p[0], 0));
    solid = std::max(solid, 0.2 - length(p[0] + 0.4, p[1] + 0.4, p[2] + 0.4));
    return solid;
  });
}

// A cup: a thick-walled half shell with a handle.
inline TriangleMesh make_cup(int n) {
  return make_implicit({-1.2, -1.2, -1.2}, {1.9, 1.2, 0.9}, n, [](Point p) {
    const double r = length(p[0], p[1], p[2]);
    const double shell = std::max(std::fabs(r - 0.95) - 0.08, p[2] - 0.5);
    const double handle =
        std::max(length(length(p[0] - 1.05, 0, p[2] + 0.1) - 0.42, p[1], 0) - 0.09, 0.9 - r);
    return std::min(shell, handle);
  });
}

}  // namespace shapes

// Sixteen of them, 5,000 to 60,000 triangles each.
inline std::vector<ClosedShape> closed_shapes() {
  using shapes::kPi;
  using shapes::Point;
  std::vector<ClosedShape> s;
  s.push_back({"bumpy sphere", [] { return make_bumpy_sphere(5); }, 1, 0});
  s.push_back({"torus", [] { return make_torus(96, 40); }, 1, 1});
  s.push_back({"double torus", [] { return shapes::make_double_torus(80); }, 1, 2});
  s.push_back({"thin plate", [] { return make_box({60, 60, 2}, {2, 2, 0.02}); }, 1, 0});
  s.push_back({"spike",
               [] {
                 return mapped(make_sphere(5), [](Point p) {
                   const double d = std::max(0.0, p[2] - 0.9) / 0.1, stretch = 1 + 2 * d * d * d;
                   return Point{p[0], p[1], p[2] * stretch};
                 });
               },
               1, 0});
  s.push_back({"nested spheres", [] { return make_nested_spheres(4); }, 2, 0});
  s.push_back({"trefoil knot",
               [] {
                 return make_tube(400, 24, 0.3, [](double t) {
                   return Point{std::sin(t) + 2 * std::sin(2 * t), std::cos(t) - 2 * std::cos(2 * t),
                                -std::sin(3 * t)};
                 });
               },
               1, 1});
  s.push_back({"cube", [] { return make_cube(24); }, 1, 0});
  s.push_back({"cheese", [] { return shapes::make_cheese(60); }, 2, 3});
  s.push_back({"linked rings",
               [] {
                 return joined(make_torus(96, 40), flipped(mapped(make_torus(96, 40), [](Point p) {
                                 return Point{p[0] + 1, p[2], p[1]};
                               })));
               },
               2, 2});
  s.push_back({"drilled slab", [] { return shapes::make_drilled(3, 3, 0.3, 0.3, 90); }, 1, 9});
  s.push_back({"cup", [] { return shapes::make_cup(80); }, 1, 1});
  s.push_back(
      {"touching spheres", [] { return joined(make_sphere(4), moved(make_sphere(4), 2.01, 0, 0)); }, 2, 0});
  s.push_back({"moons",
               [] {
                 TriangleMesh swarm = make_sphere(5);
                 for (int i = 0; i < 12; i++)
                   swarm = joined(swarm, moved(make_sphere(i % 3, 0.03), 1.3 * std::cos(0.5 * i),
                                               1.3 * std::sin(0.5 * i), 0.1 * (i % 5)));
                 return swarm;
               },
               13, 0});
  s.push_back({"flattened",
               [] {
                 return mapped(make_bumpy_sphere(5), [](Point p) { return Point{p[0], p[1], 0.03 * p[2]}; });
               },
               1, 0});
  s.push_back({"star",
               [] {
                 return mapped(make_sphere(6), [](Point p) {
                   const double a = std::atan2(p[1], p[0]),
                                r = 1 + 0.6 * std::pow(std::fabs(std::sin(2.5 * a)), 4) * (1 - p[2] * p[2]);
                   return Point{r * p[0], r * p[1], 0.4 * p[2]};
                 });
               },
               1, 0});
  return s;
}

}  // namespace relief
