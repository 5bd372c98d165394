// clusterings MODEL [--aperture DEG]: patches and cost (paper, equation 4, over the surface's area) of the
// partitions by both clusterings of 3.3, boundary shapes optimised. Prints JSON.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "partition/partition.h"
#include "surface/import.h"

namespace relief {
namespace {

using Json = nlohmann::ordered_json;

Json report_of(const Surface& surface, double aperture, Clustering clustering) {
  PartitionOptions options;
  options.aperture = aperture;
  options.clustering = clustering;
  const auto begin = std::chrono::steady_clock::now();
  const Partition partition = partition_surface(surface, options);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  return {{"patches", partition.normal.size()},
          {"cost", partition_cost(surface, partition)},
          {"seconds", took.count()}};
}

}  // namespace
}  // namespace relief

int main(int argc, char** argv) {
  CLI::App app("Patches and cost of both clusterings");
  std::string model;
  double aperture = 80;
  app.add_option("MODEL", model, ".ply .obj .off .stl .glb .gltf")->required();
  app.add_option("--aperture", aperture, "Degrees (80)");
  CLI11_PARSE(app, argc, argv);
  try {
    const relief::Surface surface = relief::build_surface(relief::read_mesh(model));
    const relief::Json json = {
        {"vertices", surface.vertices.size()},
        {"gla", relief::report_of(surface, aperture, relief::Clustering::kLloyd)},
        {"split-merge", relief::report_of(surface, aperture, relief::Clustering::kSplitMerge)}};
    std::printf("%s\n", json.dump(2).c_str());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "clusterings: %s: %s\n", model.c_str(), e.what());
    return 1;
  }
  return 0;
}
