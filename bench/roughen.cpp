// roughen MODEL OUT.ply [--parts K] [--roughness R]: a larger surface out of a model. Every edge is cut into
// K parts, every triangle into K^2, curved by its vertices' normals; then vertices are displaced along their
// normals by noise, so that there is detail at every scale down to a few of the new edges.
#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>

#include "surface/half_edges.h"
#include "surface/import.h"
#include "surface/surface.h"

namespace relief {
namespace {

// As the encoder sees it: what cannot be part of a surface is mended or left out.
TriangleMesh mended(const TriangleMesh& model) {
  const Surface surface = build_surface(model);
  TriangleMesh mesh;
  for (const Vec3& v : surface.vertices) {
    const Vec3 p = surface.origin + surface.scale * v;
    mesh.positions.push_back({float(p.x()), float(p.y()), float(p.z())});
  }
  for (const auto& f : surface.faces)
    mesh.triangles.push_back({uint32_t(f[0]), uint32_t(f[1]), uint32_t(f[2])});
  return mesh;
}

std::vector<Vec3> points_of(const TriangleMesh& mesh) {
  std::vector<Vec3> points;
  for (const auto& p : mesh.positions) points.emplace_back(p[0], p[1], p[2]);
  return points;
}

std::vector<Vec3> vertex_normals(const std::vector<Vec3>& points, const Triangles& triangles) {
  std::vector<Vec3> normals(points.size(), Vec3::Zero());
  for (const auto& [a, b, c] : triangles) {
    const Vec3 n = (points[b] - points[a]).cross(points[c] - points[a]);
    for (uint32_t v : {a, b, c}) normals[v] += n;
  }
  for (Vec3& n : normals) n.normalize();  // zero stays zero
  return normals;
}

double mean_edge(const std::vector<Vec3>& points, const Triangles& triangles) {
  double sum = 0;
  for (const auto& [a, b, c] : triangles)
    sum += (points[b] - points[a]).norm() + (points[c] - points[b]).norm() + (points[a] - points[c]).norm();
  return sum / (3 * double(triangles.size()));
}

// Value noise: a random number of -1 to 1 at each point of the integer grid, smoothly between.
double value_at(int64_t x, int64_t y, int64_t z) {
  uint64_t h = uint64_t(x) * 0x9e3779b97f4a7c15ull ^ uint64_t(y) * 0xc2b2ae3d27d4eb4full ^
               uint64_t(z) * 0x165667b19e3779f9ull;
  h = (h ^ h >> 32) * 0xd6e8feb86659fd93ull;
  h = (h ^ h >> 32) * 0xd6e8feb86659fd93ull;
  return double(h >> 11) / double(1ull << 52) - 1;
}

double noise(const Vec3& p) {
  const Vec3 low = p.array().floor(), t = p - low;
  const Vec3 s = t.array().cube() * (t.array() * (t.array() * 6 - 15) + 10);
  double sum = 0;
  for (int corner = 0; corner < 8; corner++) {
    double weight = 1;
    int64_t at[3];
    for (int k = 0; k < 3; k++) {
      const int bit = corner >> k & 1;
      at[k] = int64_t(low[k]) + bit;
      weight *= bit ? s[k] : 1 - s[k];
    }
    sum += weight * value_at(at[0], at[1], at[2]);
  }
  return sum;
}

// Where the parts of edges and triangles lie: first the vertices of the model, then K - 1 on every edge, then
// those inside of every triangle, row by row.
class Grid {
 public:
  Grid(const Triangles& triangles, size_t vertices, uint32_t parts)
      : triangles_(triangles), parts_(parts), edge_(triangles.size() * 3) {
    uint32_t edges = 0;
    for_each_edge(triangles, vertices, [&](std::span<const uint32_t> edge) {
      for (uint32_t h : edge) edge_[h] = edges;
      edges++;
    });
    first_on_edges_ = uint32_t(vertices);
    first_inside_ = first_on_edges_ + edges * (parts - 1);
    size_ = first_inside_ + uint32_t(triangles.size()) * inside();
  }

  uint32_t size() const { return size_; }

  // The point i/K of the way from corner 0 to 1 and j/K of the way from corner 0 to 2.
  uint32_t vertex(uint32_t face, uint32_t i, uint32_t j) const {
    const auto& t = triangles_[face];
    const uint32_t rest = parts_ - i - j;
    if (i == parts_) return t[1];
    if (j == parts_) return t[2];
    if (rest == parts_) return t[0];
    if (j == 0) return on_edge(3 * face, i);
    if (rest == 0) return on_edge(3 * face + 1, j);
    if (i == 0) return on_edge(3 * face + 2, rest);
    const uint32_t row = (j - 1) * (parts_ - 1) - j * (j - 1) / 2;  // points of the rows before
    return first_inside_ + face * inside() + row + i - 1;
  }

 private:
  uint32_t inside() const { return (parts_ - 1) * (parts_ - 2) / 2; }
  uint32_t on_edge(uint32_t h, uint32_t steps) const {
    const bool up = from_vertex(triangles_, h) < to_vertex(triangles_, h);
    return first_on_edges_ + edge_[h] * (parts_ - 1) + (up ? steps : parts_ - steps) - 1;
  }

  const Triangles& triangles_;
  uint32_t parts_, first_on_edges_, first_inside_, size_;
  std::vector<uint32_t> edge_;  // of each half-edge
};

TriangleMesh roughen(const TriangleMesh& model, uint32_t parts, double roughness) {
  constexpr int kOctaves = 4;  // from four edges of the model down
  const std::vector<Vec3> points = points_of(model), normals = vertex_normals(points, model.triangles);
  const double edge = mean_edge(points, model.triangles);
  const Grid grid(model.triangles, points.size(), parts);
  TriangleMesh mesh;
  mesh.positions.resize(grid.size());
  mesh.triangles.reserve(model.triangles.size() * parts * parts);
  for (uint32_t f = 0; f < model.triangles.size(); f++) {
    const auto& [a, b, c] = model.triangles[f];
    for (uint32_t j = 0; j <= parts; j++)
      for (uint32_t i = 0; i + j <= parts; i++) {
        const double u = double(i) / parts, v = double(j) / parts, w = 1 - u - v;
        Vec3 p = w * points[a] + u * points[b] + v * points[c];
        const Vec3 n = w * normals[a] + u * normals[b] + v * normals[c];
        double height = 0, wavelength = 4 * edge;
        for (int octave = 0; octave < kOctaves; octave++, wavelength /= 2)
          height += roughness * wavelength * noise(p / wavelength);
        p += height * n;
        mesh.positions[grid.vertex(f, i, j)] = {float(p.x()), float(p.y()), float(p.z())};
        if (i + j == parts) continue;
        mesh.triangles.push_back({grid.vertex(f, i, j), grid.vertex(f, i + 1, j), grid.vertex(f, i, j + 1)});
        if (i + j + 1 < parts)
          mesh.triangles.push_back(
              {grid.vertex(f, i + 1, j), grid.vertex(f, i + 1, j + 1), grid.vertex(f, i, j + 1)});
      }
  }
  return mesh;
}

}  // namespace
}  // namespace relief

int main(int argc, char** argv) {
  CLI::App app("A larger and rougher surface");
  std::string model, out;
  uint32_t parts = 4;
  double roughness = 0.02;
  app.add_option("MODEL", model, ".ply .obj .off .stl .glb .gltf")->required();
  app.add_option("OUT", out, ".ply")->required();
  app.add_option("--parts", parts, "Into which every edge is cut (4)")->check(CLI::Range(1, 16));
  app.add_option("--roughness", roughness, "Height of the noise over its wavelength (0.02)");
  CLI11_PARSE(app, argc, argv);
  try {
    relief::write_mesh(out, relief::roughen(relief::mended(relief::read_mesh(model)), parts, roughness));
  } catch (const std::exception& e) {
    std::fprintf(stderr, "roughen: %s: %s\n", model.c_str(), e.what());
    return 1;
  }
  return 0;
}
