// Analytic meshes for the tests. All are counter-clockwise seen from outside and share their vertices.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "relief/encoder.h"

namespace relief {

// The highest effort that tries no more than one partition: where a test makes many streams.
constexpr int kOnePartition = 4;

namespace shapes {

using Point = std::array<double, 3>;

constexpr double kPi = 3.14159265358979323846;

inline uint32_t add(TriangleMesh& mesh, const Point& p) {
  mesh.positions.push_back({float(p[0]), float(p[1]), float(p[2])});
  return uint32_t(mesh.positions.size() - 1);
}

// Two triangles for the quad a, b, c, d (counter-clockwise).
inline void add_quad(TriangleMesh& mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

}  // namespace shapes

// The other side becomes the outside.
inline TriangleMesh flipped(TriangleMesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

// Every position p becomes map(p).
inline TriangleMesh mapped(TriangleMesh mesh, const std::function<shapes::Point(shapes::Point)>& map) {
  for (auto& p : mesh.positions) {
    shapes::Point q = map({p[0], p[1], p[2]});
    p = {float(q[0]), float(q[1]), float(q[2])};
  }
  return mesh;
}

inline TriangleMesh scaled(const TriangleMesh& mesh, double s) {
  return mapped(mesh, [s](shapes::Point p) { return shapes::Point{p[0] * s, p[1] * s, p[2] * s}; });
}

inline TriangleMesh moved(const TriangleMesh& mesh, double x, double y, double z) {
  return mapped(mesh, [=](shapes::Point p) { return shapes::Point{p[0] + x, p[1] + y, p[2] + z}; });
}

// Both meshes in one, sharing nothing.
inline TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
  uint32_t base = uint32_t(a.positions.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (const auto& t : b.triangles) a.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  return a;
}

// An icosahedron whose triangles are split in four `subdivisions` times: 10 * 4^s + 2 vertices, 20 * 4^s
// triangles.
inline TriangleMesh make_sphere(int subdivisions, double radius = 1) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  std::vector<shapes::Point> v = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                                  {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  TriangleMesh mesh;
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  auto unit = [](shapes::Point p) {
    double n = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    return shapes::Point{p[0] / n, p[1] / n, p[2] / n};
  };
  for (auto& p : v) p = unit(p);
  for (int s = 0; s < subdivisions; s++) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
    auto middle = [&](uint32_t a, uint32_t b) {
      auto [it, inserted] = middles.try_emplace(std::minmax(a, b), uint32_t(v.size()));
      if (inserted) v.push_back(unit({v[a][0] + v[b][0], v[a][1] + v[b][1], v[a][2] + v[b][2]}));
      return it->second;
    };
    std::vector<std::array<uint32_t, 3>> split;
    for (const auto& [a, b, c] : mesh.triangles) {
      uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      split.insert(split.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(split);
  }
  for (const auto& p : v) shapes::add(mesh, {p[0] * radius, p[1] * radius, p[2] * radius});
  return mesh;
}

// A sphere of radius 1 with `waves` bumps around the equator, of the given height.
inline TriangleMesh make_bumpy_sphere(int subdivisions, double height = 0.05, int waves = 9) {
  return mapped(make_sphere(subdivisions), [=](shapes::Point p) {
    double r = 1 + height * std::sin(waves * std::atan2(p[1], p[0])) * (1 - p[2] * p[2]) +
               height * std::sin(waves * 1.3 * p[2] + 0.7);
    return shapes::Point{p[0] * r, p[1] * r, p[2] * r};
  });
}

// A sphere of radius 1 around one of radius 0.5 that faces the hollow: two components.
inline TriangleMesh make_nested_spheres(int subdivisions) {
  return joined(make_sphere(subdivisions), flipped(make_sphere(subdivisions, 0.5)));
}

// The tube of radius r around the circle of radius R in the plane z = 0; around * across vertices.
inline TriangleMesh make_torus(int around, int across, double R = 1, double r = 0.4) {
  TriangleMesh mesh;
  for (int i = 0; i < around; i++)
    for (int j = 0; j < across; j++) {
      double u = 2 * shapes::kPi * i / around, w = 2 * shapes::kPi * j / across;
      double d = R + r * std::cos(w);
      shapes::add(mesh, {d * std::cos(u), d * std::sin(u), r * std::sin(w)});
    }
  auto at = [=](int i, int j) { return uint32_t((i % around) * across + j % across); };
  for (int i = 0; i < around; i++)
    for (int j = 0; j < across; j++)
      shapes::add_quad(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
  return mesh;
}

// The upper half of a sphere of radius 1, open at the rim z = 0: one pole and `rings` circles of `segments`
// vertices.
inline TriangleMesh make_hemisphere(int rings, int segments) {
  TriangleMesh mesh;
  shapes::add(mesh, {0, 0, 1});
  for (int i = 1; i <= rings; i++)
    for (int j = 0; j < segments; j++) {
      double t = shapes::kPi / 2 * i / rings, u = 2 * shapes::kPi * j / segments;
      double z = i == rings ? 0 : std::cos(t);
      shapes::add(mesh, {std::sin(t) * std::cos(u), std::sin(t) * std::sin(u), z});
    }
  auto at = [=](int i, int j) { return uint32_t(1 + (i - 1) * segments + j % segments); };
  for (int j = 0; j < segments; j++) mesh.triangles.push_back({0, at(1, j), at(1, j + 1)});
  for (int i = 1; i < rings; i++)
    for (int j = 0; j < segments; j++)
      shapes::add_quad(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
  return mesh;
}

// A box centred at 0; each side is a grid of cells, nx, ny and nz along the axes.
inline TriangleMesh make_box(std::array<int, 3> cells, shapes::Point size) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, uint32_t> index;
  auto at = [&](std::array<int, 3> c) {
    auto [it, inserted] = index.try_emplace(c, uint32_t(mesh.positions.size()));
    if (inserted) {
      shapes::Point p;
      for (int k = 0; k < 3; k++) p[k] = size[k] * (double(c[k]) / cells[k] - 0.5);
      shapes::add(mesh, p);
    }
    return it->second;
  };
  for (int axis = 0; axis < 3; axis++)
    for (int side = 0; side < 2; side++) {
      int a = (axis + 1) % 3, b = (axis + 2) % 3;
      if (side == 0) std::swap(a, b);
      for (int i = 0; i < cells[a]; i++)
        for (int j = 0; j < cells[b]; j++) {
          std::array<int, 3> c{};
          c[axis] = side * cells[axis];
          auto corner = [&](int x, int y) {
            c[a] = x, c[b] = y;
            return at(c);
          };
          uint32_t p = corner(i, j), q = corner(i + 1, j), r = corner(i + 1, j + 1), s = corner(i, j + 1);
          shapes::add_quad(mesh, p, q, r, s);
        }
    }
  return mesh;
}

// The cube [-1, 1]^3, each side a grid of cells * cells quads.
inline TriangleMesh make_cube(int cells) { return make_box({cells, cells, cells}, {2, 2, 2}); }

// A closed square plate of side 2, thin along z: two large sides closer than a grid spacing.
inline TriangleMesh make_plate(int cells, double thickness = 0.02) {
  return make_box({cells, cells, 1}, {2, 2, thickness});
}

// With pinholes through a plate: around each place a triangle above and one below are taken away, and joined.
inline TriangleMesh drilled(TriangleMesh mesh, const std::vector<std::array<double, 2>>& places) {
  auto middle = [&](const std::array<uint32_t, 3>& t, size_t k) {
    return (double(mesh.positions[t[0]][k]) + mesh.positions[t[1]][k] + mesh.positions[t[2]][k]) / 3;
  };
  auto take_nearest = [&](const std::array<double, 2>& at, bool above) {
    auto far = [&](const std::array<uint32_t, 3>& t) {
      return (middle(t, 2) > 0) == above ? std::hypot(middle(t, 0) - at[0], middle(t, 1) - at[1]) : INFINITY;
    };
    const auto found = std::min_element(mesh.triangles.begin(), mesh.triangles.end(),
                                        [&](const auto& a, const auto& b) { return far(a) < far(b); });
    const std::array<uint32_t, 3> triangle = *found;
    mesh.triangles.erase(found);
    return triangle;
  };
  for (const auto& place : places) {
    const auto a = take_nearest(place, true), b = take_nearest({middle(a, 0), middle(a, 1)}, false);
    size_t turn = 0;
    double least = INFINITY;
    for (size_t r = 0; r < 3; r++) {
      double sum = 0;
      for (size_t i = 0; i < 3; i++)
        for (size_t k = 0; k < 2; k++)
          sum += std::fabs(double(mesh.positions[a[i]][k]) - mesh.positions[b[(r + 3 - i) % 3]][k]);
      if (sum < least) least = sum, turn = r;
    }
    for (size_t i = 0; i < 3; i++) {
      const size_t j = (i + 1) % 3;
      shapes::add_quad(mesh, a[i], a[j], b[(turn + 3 - j) % 3], b[(turn + 3 - i) % 3]);
    }
  }
  return mesh;
}

// The open surface z = height(x, y) over the square [-1, 1]^2, a grid of cells * cells quads.
inline TriangleMesh make_height_field(int cells, const std::function<double(double, double)>& height) {
  TriangleMesh mesh;
  for (int j = 0; j <= cells; j++)
    for (int i = 0; i <= cells; i++) {
      double x = 2.0 * i / cells - 1, y = 2.0 * j / cells - 1;
      shapes::add(mesh, {x, y, height(x, y)});
    }
  auto at = [=](int i, int j) { return uint32_t(j * (cells + 1) + i); };
  for (int j = 0; j < cells; j++)
    for (int i = 0; i < cells; i++)
      shapes::add_quad(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
  return mesh;
}

// A height field of gentle waves.
inline TriangleMesh make_waves(int cells, double height = 0.1) {
  return make_height_field(
      cells, [=](double x, double y) { return height * std::sin(4 * x + 1) * std::cos(3 * y) + 0.1 * x; });
}

}  // namespace relief
