// ledger MODEL [--error E | --bytes N] [--density MU] [--no-fit] [--json]: encodes a model and tells where the bytes of the stream go
// and where the error of the decoded surface lies. Errors are in 1e-4 of the diagonal of the bounding box.
#include "code/ledger.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "error_ledger.h"
#include "measure/surface_error.h"
#include "relief/encoder.h"
#include "seams/decoded.h"
#include "surface/import.h"

namespace relief {
namespace {

using Json = nlohmann::ordered_json;

// E of a decoded stream, both ways and the larger.
struct Rms {
  double to_decoded = 0, to_original = 0, both = 0;
};

struct Report {
  size_t stream_bytes = 0, vertices = 0;
  bool target_met = false;
  Ledger bytes;
  Rms quantised, unquantised;
  ErrorLedger error;
};

Rms rms_of(const ErrorMeter& meter, const TriangleMesh& decoded) {
  const SurfaceError e = meter.measure(decoded);
  const double unit = 1e4 / e.diagonal;
  return {e.rms_ab * unit, e.rms_ba * unit, e.rms * unit};
}

Report report_of(const TriangleMesh& mesh, EncodeOptions options) {
  options.unquantised = true;
  const EncodeResult result = encode(mesh, options);
  Report r;
  r.stream_bytes = result.stream.size();
  r.vertices = mesh.positions.size();
  r.target_met = result.target_met;
  r.bytes = read_ledger(result.stream);

  const DecodedMesh decoded = decode_with_seams(result.stream);
  const ErrorMeter meter(mesh, 1'000'000);
  r.quantised = rms_of(meter, decoded.mesh);
  if (!result.unquantised.empty())
    r.unquantised = rms_of(meter, decode(result.unquantised.data(), result.unquantised.size()));
  std::vector<uint32_t> pixels;
  for (const Ledger::P& p : r.bytes.patches) pixels.push_back(p.pixels);
  r.error = read_error_ledger(mesh, decoded, pixels);
  return r;
}

// Of E^2: what is left without quantisation.
double sampling_share(double unquantised, double quantised) {
  return quantised > 0 ? std::pow(unquantised / quantised, 2) : 0;
}

Json json_of(const ErrorLedger::Part& p) { return {{"area", p.area}, {"share", p.share}, {"rms", p.rms}}; }

Json json_of(const ErrorLedger::Side& side) {
  Json json = {{"e_rms", side.rms},
               {"e_max", side.max},
               {"share_of_worst_100th", side.worst_100th},
               {"share_of_worst_1000th", side.worst_1000th},
               {"spots", Json::array()}};
  for (const ErrorLedger::Spot& s : side.spots)
    json["spots"].push_back(
        {{"place", s.place}, {"farthest", s.farthest}, {"share", s.share}, {"gap", s.gap}});
  return json;
}

Json json_of(const Ledger& l) {
  Json json = {{"header", l.header},      {"side", l.side},
               {"masks", l.masks},        {"coefficients", l.coefficients},
               {"seams", l.seams},        {"by_level", l.by_level},
               {"by_band", Json::array()}};
  for (const auto& level : l.by_band) {
    Json& bands = json["by_band"].emplace_back(Json::object());
    for (size_t band = 0; band < Ledger::kBands; band++) bands[Ledger::kBandNames[band]] = level[band];
  }
  return json;
}

Json json_of(const Rms& rms) {
  return {{"to_decoded", rms.to_decoded}, {"to_original", rms.to_original}, {"e_rms", rms.both}};
}

Json json_of(const Report& r) {
  Json json = {{"bytes", r.stream_bytes},
               {"vertices", r.vertices},
               {"target_met", r.target_met},
               {"diagonal", r.error.diagonal},
               {"where_bytes_go", json_of(r.bytes)},
               {"error", json_of(r.quantised)},
               {"error_unquantised", json_of(r.unquantised)},
               {"share_of_sampling", sampling_share(r.unquantised.both, r.quantised.both)},
               {"by_ring", Json::object()},
               {"decoded_to_original", json_of(r.error.to_original)},
               {"original_to_decoded", json_of(r.error.to_decoded)},
               {"patches", Json::array()}};
  for (size_t i = 0; i < kRings.size(); i++) json["by_ring"][kRings[i]] = json_of(r.error.by_ring[i]);
  for (size_t i = 0; i < r.bytes.patches.size(); i++) {
    const Ledger::P& p = r.bytes.patches[i];
    Json patch = {{"bytes_masks", p.masks},
                  {"bytes_coefficients", p.coefficients},
                  {"pixels", p.pixels},
                  {"spacing", p.spacing}};
    patch.update(json_of(r.error.by_patch[i]));
    json["patches"].push_back(patch);
  }
  return json;
}

void print_bytes(const char* what, uint64_t bytes, size_t all) {
  std::printf("  %-20s %9llu  %5.1f%%\n", what, static_cast<unsigned long long>(bytes),
              100 * double(bytes) / double(all));
}

void print_ledger(const Ledger& l, size_t all) {
  std::printf("\nwhere the bytes go\n");
  print_bytes("header", l.header, all);
  print_bytes("side information", l.side, all);
  print_bytes("masks", l.masks, all);
  print_bytes("seams", l.seams, all);
  print_bytes("coefficients", l.coefficients, all);
  std::printf("\n  %-20s %9s  %6s", "level", "bytes", "");
  for (const char* name : Ledger::kBandNames) std::printf(" %16s", name);
  std::printf("\n");
  for (size_t i = 0; i < l.by_band.size(); i++) {
    std::printf("  %zu%-19s %9llu  %5.1f%%", i, i == 0 ? " (coarsest)" : "",
                static_cast<unsigned long long>(l.by_level[i]), 100 * double(l.by_level[i]) / double(all));
    for (uint64_t band : l.by_band[i])
      std::printf(" %8llu  %5.1f%%", static_cast<unsigned long long>(band), 100 * double(band) / double(all));
    std::printf("\n");
  }
}

void print_rms(const char* what, const Rms& rms) {
  std::printf("  %-20s %8.4f %22.4f %22.4f\n", what, rms.both, rms.to_decoded, rms.to_original);
}

void print_error(const Report& r) {
  const double sampling = sampling_share(r.unquantised.both, r.quantised.both);
  std::printf("\nwhere the error goes (1e-4 of the diagonal)\n  %-20s %8s %22s %22s\n", "", "E",
              "original to decoded", "decoded to original");
  print_rms("decoded", r.quantised);
  print_rms("without quantisation", r.unquantised);
  std::printf("  of E^2: sampling %.1f%%, quantisation %.1f%%\n", 100 * sampling, 100 * (1 - sampling));
  std::printf("\n  %-20s %7s %7s %8s   (decoded to original)\n", "by distance to gaps", "area", "of E^2",
              "rms");
  for (size_t i = 0; i < kRings.size(); i++) {
    const ErrorLedger::Part& p = r.error.by_ring[i];
    std::printf("  %-20s %6.2f%% %6.2f%% %8.3f\n", kRings[i].c_str(), 100 * p.area, 100 * p.share, p.rms);
  }
}

void print_side(const char* what, const ErrorLedger::Side& side) {
  std::printf("\nworst samples, %s\n  1%% of them: %.1f%% of E^2; 0.1%%: %.1f%%; farthest %.2f\n", what,
              100 * side.worst_100th, 100 * side.worst_1000th, side.max);
  std::printf("  %-4s %9s %8s  %-4s  %s\n", "spot", "farthest", "of E^2", "gap", "place");
  for (size_t i = 0; i < side.spots.size(); i++) {
    const ErrorLedger::Spot& s = side.spots[i];
    std::printf("  %-4zu %9.2f %7.3f%%  %-4s  %.6g %.6g %.6g\n", i + 1, s.farthest, 100 * s.share,
                s.gap ? "yes" : "no", s.place[0], s.place[1], s.place[2]);
  }
}

void print_patches(const Report& r) {
  std::printf("\n  %-5s %8s %12s %8s %11s %7s %7s %8s\n", "patch", "masks", "coefficients", "pixels",
              "spacing", "area", "of E^2", "rms");
  for (size_t i = 0; i < r.bytes.patches.size(); i++) {
    const Ledger::P& p = r.bytes.patches[i];
    const ErrorLedger::Part& e = r.error.by_patch[i];
    std::printf("  %-5zu %8llu %12llu %8u %11.5g %6.2f%% %6.2f%% %8.3f\n", i,
                static_cast<unsigned long long>(p.masks), static_cast<unsigned long long>(p.coefficients),
                p.pixels, p.spacing, 100 * e.area, 100 * e.share, e.rms);
  }
}

void print_text(const Report& r) {
  std::printf("%zu bytes, %.3f bits a vertex of the input, %zu patches%s\n", r.stream_bytes,
              8 * double(r.stream_bytes) / double(r.vertices), r.bytes.patches.size(),
              r.target_met ? "" : "; the target could not be met");
  print_ledger(r.bytes, r.stream_bytes);
  print_error(r);
  print_side("decoded to original", r.error.to_original);
  print_side("original to decoded", r.error.to_decoded);
  print_patches(r);
}

}  // namespace
}  // namespace relief

int main(int argc, char** argv) {
  CLI::App app("Where the bytes of a stream go, and where the error of what it decodes to lies");
  std::string model;
  bool json = false, no_fit = false;
  relief::EncodeOptions options;
  app.add_option("MODEL", model, ".ply .obj .off .stl .glb .gltf")->required();
  CLI::Option* error =
      app.add_option("--error", options.error, "Target, as a fraction of the diagonal (1e-4)");
  app.add_option("--bytes", options.bytes, "Target, bytes of the stream")->excludes(error);
  app.add_option("--density", options.density, "Grid spacing over the mean vertex spacing");
  app.add_flag("--no-fit", no_fit, "Sample elevations instead of fitting them by least squares");
  app.add_flag("--json", json, "Print JSON");
  CLI11_PARSE(app, argc, argv);
  options.fit = !no_fit;
  try {
    const relief::Report report = relief::report_of(relief::read_mesh(model), options);
    if (json)
      std::printf("%s\n", relief::json_of(report).dump(2).c_str());
    else
      relief::print_text(report);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "ledger: %s: %s\n", model.c_str(), e.what());
    return 1;
  }
  return 0;
}
