#include <cmath>
#include <memory>

#include "common.h"
#include "measure/surface_error.h"
#include "measure/topology.h"
#include "patch_colors.h"
#include "points/point_error.h"

namespace relief::cli {

namespace {

struct Arguments {
  Common common;
  std::string a, b, heatmap;
  size_t samples = 400000;
  bool by_index = false;
};

// A row of the table, and a member of the JSON object of a mesh.
struct Row {
  const char *key, *text;
  int64_t a, b;
};

std::vector<Row> rows(const TriangleMesh& a, const Topology& ta, const TriangleMesh& b, const Topology& tb) {
  return {{"vertices", "vertices", int64_t(a.positions.size()), int64_t(b.positions.size())},
          {"triangles", "triangles", int64_t(a.triangles.size()), int64_t(b.triangles.size())},
          {"components", "components", int64_t(ta.components), int64_t(tb.components)},
          {"boundary_loops", "boundary loops", int64_t(ta.boundary_loops), int64_t(tb.boundary_loops)},
          {"open_edges", "open edges", int64_t(ta.open_edges), int64_t(tb.open_edges)},
          {"nonmanifold_edges", "non-manifold edges", int64_t(ta.nonmanifold_edges),
           int64_t(tb.nonmanifold_edges)},
          {"nonmanifold_vertices", "non-manifold vertices", int64_t(ta.nonmanifold_vertices),
           int64_t(tb.nonmanifold_vertices)},
          {"euler", "Euler characteristic", ta.euler, tb.euler},
          {"genus", "genus (-1: not manifold)", ta.genus, tb.genus},
          {"flipped", "flipped neighbours", int64_t(ta.flipped), int64_t(tb.flipped)}};
}

void print_json(const Arguments& arguments, const SurfaceError& e, const std::vector<Row>& table) {
  double unit = 1e4 / e.diagonal;
  Json a = {{"file", arguments.a}}, b = {{"file", arguments.b}};
  for (const Row& row : table) {
    a[row.key] = row.a;
    b[row.key] = row.b;
  }
  Json json = {{"e_rms", e.rms * unit},
               {"e_rms_deviation", e.rms_deviation * unit},
               {"e_max", e.max * unit},
               {"e_rms_ab", e.rms_ab * unit},
               {"e_rms_ba", e.rms_ba * unit},
               {"e_max_ab", e.max_ab * unit},
               {"e_max_ba", e.max_ba * unit},
               {"psnr", e.psnr},
               {"normal_mean", e.normal_mean},
               {"normal_p99", e.normal_p99},
               {"diagonal", e.diagonal},
               {"samples", arguments.samples},
               {"a", a},
               {"b", b}};
  std::printf("%s\n", json.dump(2).c_str());
}

void print_text(const Arguments& arguments, const SurfaceError& e, const std::vector<Row>& table) {
  double unit = 1e4 / e.diagonal;
  std::printf("E_rms  %9.4f   A to B %9.4f   B to A %9.4f   (1e-4 of A's diagonal, %g)\n", e.rms * unit,
              e.rms_ab * unit, e.rms_ba * unit, e.diagonal);
  std::printf("E_max  %9.4f   A to B %9.4f   B to A %9.4f\n", e.max * unit, e.max_ab * unit, e.max_ba * unit);
  std::printf("PSNR   %9.2f dB\n", e.psnr);
  std::printf("normal deviation: mean %.2f, 99th percentile %.2f degrees\n\n", e.normal_mean, e.normal_p99);
  std::printf("%-26s %16s %16s\n", "", "A", "B");
  for (const Row& row : table)
    std::printf("%-26s %16lld %16lld\n", row.text, static_cast<long long>(row.a),
                static_cast<long long>(row.b));
  std::printf("A: %s\nB: %s\n", arguments.a.c_str(), arguments.b.c_str());
}

int compare_points(const Arguments& arguments, const TriangleMesh& a, const TriangleMesh& b) {
  if (!arguments.heatmap.empty()) throw UsageError("--heatmap needs meshes, not points");
  const PointError e =
      about(a.triangles.empty() ? arguments.a : arguments.b, [&] { return point_error(a, b); });
  const double unit = 1e4 / e.diagonal, rms = std::max(e.rms_ab, e.rms_ba),
               max = std::max(e.max_ab, e.max_ba);
  const bool both = a.triangles.empty() && b.triangles.empty();
  const char* measured = both                  ? "points to the MLS surface of the other's, both ways"
                         : a.triangles.empty() ? "points of A to the triangles of B, one way"
                                               : "points of B to the triangles of A, one way";
  if (arguments.common.json) {
    auto side = [](const std::string& file, const TriangleMesh& mesh) {
      return Json{{"file", file}, {"vertices", mesh.positions.size()}, {"triangles", mesh.triangles.size()}};
    };
    Json json = {{"measured", measured},   {"e_rms", rms * unit},       {"e_max", max * unit},
                 {"diagonal", e.diagonal}, {"a", side(arguments.a, a)}, {"b", side(arguments.b, b)}};
    if (both || a.triangles.empty()) json["e_rms_ab"] = e.rms_ab * unit, json["e_max_ab"] = e.max_ab * unit;
    if (both || b.triangles.empty()) json["e_rms_ba"] = e.rms_ba * unit, json["e_max_ba"] = e.max_ba * unit;
    std::printf("%s\n", json.dump(2).c_str());
  } else if (!arguments.common.quiet) {
    std::printf("E_rms  %9.4f   E_max %9.4f   (1e-4 of A's diagonal, %g; %s)\n", rms * unit, max * unit,
                e.diagonal, measured);
    if (both)
      std::printf("A to B %9.4f   %15.4f\nB to A %9.4f   %15.4f\n", e.rms_ab * unit, e.max_ab * unit,
                  e.rms_ba * unit, e.max_ba * unit);
    std::printf("PSNR   %9.2f dB\nA: %s, %s vertices\nB: %s, %s vertices\n",
                20 * std::log10(e.diagonal / rms), arguments.a.c_str(),
                with_commas(a.positions.size()).c_str(), arguments.b.c_str(),
                with_commas(b.positions.size()).c_str());
  }
  return kDone;
}

int run_compare(const Arguments& arguments) {
  if (!arguments.heatmap.empty()) check_output(arguments.heatmap, {".glb", ".gltf"});
  TriangleMesh a = load_mesh(arguments.a), b = load_mesh(arguments.b);
  if (a.triangles.empty() || b.triangles.empty()) return compare_points(arguments, a, b);
  std::unique_ptr<ErrorMeter> meter =
      about(arguments.a, [&] { return std::make_unique<ErrorMeter>(a, arguments.samples); });
  SurfaceError error = about(arguments.b, [&] { return meter->measure(b); });
  if (!(error.diagonal > 0)) throw FileError(arguments.a, "has no extent");
  std::vector<Row> table = rows(a, topology(a, !arguments.by_index), b, topology(b, !arguments.by_index));
  if (!arguments.heatmap.empty()) {
    constexpr size_t kFewSamples = 1000;  // only the search structure of B is needed
    write_heatmap(arguments.heatmap, a, ErrorMeter(b, kFewSamples).distance_of_positions(a), 4 * error.rms);
  }
  if (arguments.common.json)
    print_json(arguments, error, table);
  else if (!arguments.common.quiet)
    print_text(arguments, error, table);
  return kDone;
}

}  // namespace

void add_compare(CLI::App& app, Run& run) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("compare", "Measure how far two surfaces are apart, and their topology");
  command->footer(
      "  relief compare scan.ply scan.glb                      A is the original, B the copy\n"
      "  relief compare scan.ply scan.glb --heatmap heat.glb   also a picture: blue 0, red 4 E_rms\n"
      "  relief compare cloud.xyz cloud.glb                    points to the surface, one way\n"
      "  relief compare cloud.xyz decoded.ply                  both ways, if both are points");
  command->add_option("A", a->a, "The original: .ply .obj .off .stl .xyz .pcd .glb .gltf .relief")
      ->required();
  command->add_option("B", a->b, "The other one")->required();
  command->add_option("--samples", a->samples, "Sample points on each surface (default 400000)")
      ->type_name("N")
      ->check(CLI::Range(size_t(1000), size_t(100000000)));
  command->add_option("--heatmap", a->heatmap, "Write A, coloured by its distance to B (.glb)")
      ->type_name("OUT");
  command->add_flag("--by-index", a->by_index,
                    "Topology of the indices as they are (default: vertices of equal position are one)");
  add_common(*command, a->common);
  command->callback(
      [a, &run] { run = [a] { return with_threads(a->common, [a] { return run_compare(*a); }); }; });
}

}  // namespace relief::cli
