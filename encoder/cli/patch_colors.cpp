#include "patch_colors.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "gltf/gltf.h"

namespace relief::cli {

using Color = std::array<uint8_t, 4>;

// Hue in turns; the three channels are the usual trapezoids.
static Color from_hue(double hue, double saturation, double value) {
  Color color{0, 0, 0, 255};
  for (int k = 0; k < 3; k++) {
    double x = std::fmod(hue * 6 + 6 - 2 * k + 3, 6.0) - 3;  // distance from the channel's own hue
    double level = std::clamp(2 - std::abs(x), 0.0, 1.0);
    color[size_t(k)] = uint8_t(std::lround(255 * value * (1 - saturation * (1 - level))));
  }
  return color;
}

static Color patch_color(int label) {
  if (label < 0) return {255, 255, 255, 255};
  constexpr double kGolden = 0.6180339887498949;  // consecutive labels get hues far apart
  return from_hue(std::fmod(label * kGolden, 1.0), 0.55 + 0.25 * (label % 2), 0.75 + 0.25 * (label / 2 % 2));
}

void write_patch_colors(const std::string& out, const TriangleMesh& mesh, const std::vector<int>& labels) {
  TriangleMesh colored;
  std::map<std::pair<uint32_t, int>, uint32_t> vertices;  // a vertex on a seam appears once a patch
  for (size_t t = 0; t < mesh.triangles.size(); t++) {
    int label = t < labels.size() ? labels[t] : -1;
    std::array<uint32_t, 3> triangle;
    for (size_t k = 0; k < 3; k++) {
      uint32_t v = mesh.triangles[t][k];
      auto [at, inserted] = vertices.try_emplace({v, label}, uint32_t(colored.positions.size()));
      if (inserted) {
        colored.positions.push_back(mesh.positions[v]);
        if (!mesh.normals.empty()) colored.normals.push_back(mesh.normals[v]);
        colored.colors.push_back(patch_color(label));
      }
      triangle[k] = at->second;
    }
    colored.triangles.push_back(triangle);
  }
  write_mesh_gltf(out, colored);
}

void write_heatmap(const std::string& out, const TriangleMesh& mesh, const std::vector<float>& distances,
                   double red) {
  TriangleMesh colored = mesh;
  colored.colors.clear();
  for (float d : distances) {
    double level = red > 0 ? std::min(double(d) / red, 1.0) : 0;
    colored.colors.push_back(from_hue((1 - level) * 2 / 3, 1, 1));  // hue 2/3 is blue, 0 is red
  }
  write_mesh_gltf(out, colored);
}

}  // namespace relief::cli
