// make_golden FOLDER: encodes a few shapes and writes the streams and golden.txt. See golden/README.md.
#include <cstdio>
#include <fstream>

#include "decoded.h"
#include "shapes.h"

namespace relief {
namespace {

struct Shape {
  const char* name;
  TriangleMesh mesh;
  bool closed;
  size_t components;
  double error;
  Coder coder = Coder::kSubband;
  Allocation allocation = Allocation::kRateDistortion;
};

// Stripes and a slope.
TriangleMesh painted(TriangleMesh mesh) {
  for (const auto& p : mesh.positions)
    mesh.colors.push_back({uint8_t(128 + 100 * std::sin(9 * p[0])), uint8_t(128 + 60 * p[1]),
                           uint8_t(p[2] > 0 ? 200 : 40), 255});
  return mesh;
}

std::vector<Shape> golden_shapes() {
  auto wavy = [](const TriangleMesh& plate) {
    return mapped(plate, [](shapes::Point p) {
      return shapes::Point{p[0], p[1], p[2] + 0.2 * std::sin(3 * p[0] + 1) * std::cos(2 * p[1])};
    });
  };
  const TriangleMesh plate = make_plate(32, 0.1),
                     pinholes = drilled(plate, {{-0.5, -0.4}, {0.3, 0.1}, {0.6, -0.7}});
  return {{"bumpy-sphere", make_bumpy_sphere(4), true, 1, 1.2e-3},
          {"torus", make_torus(48, 20), true, 1, 2e-3},
          {"plate", wavy(plate), true, 1, 1e-3},
          {"hemisphere", make_hemisphere(16, 48), false, 1, 3e-3},
          {"nested-spheres", make_nested_spheres(3), true, 2, 2e-3},
          {"one-patch", make_waves(24), false, 1, 5e-4},
          {"bisk-torus", make_torus(48, 20), true, 1, 2e-3, Coder::kBisk},
          {"bisk-open", make_hemisphere(16, 48), false, 1, 3e-3, Coder::kBisk},
          {"bisk-even", make_bumpy_sphere(4), true, 1, 2e-3, Coder::kBisk, Allocation::kEven},
          {"pinholes", wavy(pinholes), true, 1, 2e-3},
          {"coloured-torus", painted(make_torus(48, 20)), true, 1, 2e-3},
          {"coloured-bisk", painted(make_hemisphere(16, 48)), false, 1, 3e-3, Coder::kBisk}};
}

}  // namespace
}  // namespace relief

int main(int argc, char** argv) {
  using namespace relief;
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_golden FOLDER\n");
    return 2;
  }
  const std::string folder = argv[1];
  std::ofstream list(folder + "/golden.txt");
  list << "# name, SHA-256 of the decoded mesh, 1 if the surface is closed, components. Written by "
          "make_golden.\n";
  for (const Shape& shape : golden_shapes()) {
    EncodeOptions options;
    options.error = shape.error;
    options.color_error = 8;
    options.coder = shape.coder;
    options.allocation = shape.allocation;
    const std::vector<uint8_t> stream = encode(shape.mesh, options).stream;
    const Decoded d = decode_exactly(stream.data(), stream.size());
    const std::string fault =
        d.status == RELIEF_OK ? fault_of(d, shape.closed) : relief_status_text(d.status);
    std::printf("%-16s %5zu bytes, %zu before the coefficients, %zu vertices, %zu triangles%s%s\n",
                shape.name, stream.size(), size_t(d.info.masks_end), d.vertices(), d.triangles(),
                fault.empty() ? "" : ": ", fault.c_str());
    if (!fault.empty()) return 1;
    std::ofstream file(folder + "/" + shape.name + ".relief", std::ios::binary);
    file.write(reinterpret_cast<const char*>(stream.data()), std::streamsize(stream.size()));
    list << shape.name << ' ' << hash_of(d) << ' ' << shape.closed << ' ' << shape.components << '\n';
    if (!file) return 1;
  }
  return list ? 0 : 1;
}
