#include <chrono>
#include <memory>

#include "common.h"
#include "gltf/gltf.h"
#include "patch_colors.h"
#include "surface/import.h"

namespace relief::cli {

namespace {

struct Arguments {
  Common common;
  std::string in, out, patches;
  EncodeOptions options;
  std::string coder = "subband", allocation = "rd", partition = "gla", plane = "average";
  bool no_fit = false, no_colors = false, drop_handles = false;
};

// One primitive of a scene, or the whole of a mesh file.
struct Encoded {
  std::vector<PrimitiveReport> primitives;
  double seconds = 0;
};

EncodeOptions options_for(const Arguments& arguments, double share) {
  EncodeOptions options = arguments.options;
  options.fit = !arguments.no_fit;
  options.keep_handles = !arguments.drop_handles;
  if (arguments.no_colors) options.color_error = 0;
  options.coder = arguments.coder == "bisk" ? Coder::kBisk : Coder::kSubband;
  options.allocation = arguments.allocation == "even" ? Allocation::kEven : Allocation::kRateDistortion;
  options.clustering = arguments.partition == "gla" ? Clustering::kLloyd : Clustering::kSplitMerge;
  options.plane = arguments.plane == "cone" ? Plane::kCone : Plane::kAverage;
  if (options.bytes > 0) options.bytes = std::max<uint64_t>(1, uint64_t(double(options.bytes) * share));
  return options;
}

std::vector<PrimitiveReport> encode_scene(const Arguments& arguments, ProgressBar& bar) {
  double done = 0;
  return compress_gltf(arguments.in, arguments.out, [&](const TriangleMesh& mesh, double share) {
    EncodeOptions options = options_for(arguments, share);
    options.progress = [&](const char* stage, double part) { bar.show(stage, done + share * part); };
    EncodeResult result = encode(mesh, options);
    done += share;
    // Low-poly parts of a scene may be out of reach of the target; then they stay as they are.
    if (!result.target_met && options.bytes == 0 && options.bits_per_vertex == 0)
      throw InputError(format("its target could not be met: E_rms %.3f", result.error * 1e4));
    return result;
  });
}

std::vector<PrimitiveReport> encode_mesh(const Arguments& arguments, ProgressBar& bar) {
  TriangleMesh mesh = load_mesh(arguments.in);
  EncodeOptions options = options_for(arguments, 1);
  options.progress = [&](const char* stage, double done) { bar.show(stage, done); };
  PrimitiveReport report;
  report.name = mesh.triangles.empty() ? "points" : "mesh";
  report.vertices = mesh.positions.size();
  report.triangles = mesh.triangles.size();
  report.result = encode(mesh, options);
  report.compressed = true;
  report.bytes_before = file_bytes(arguments.in);
  report.bytes_after = report.result.stream.size();
  if (is_gltf(arguments.out))
    write_stream_gltf(arguments.out, report.result.stream, mesh.triangles.empty());
  else
    write_file(arguments.out, report.result.stream);
  if (!arguments.patches.empty() && mesh.triangles.empty())
    throw InputError("--patches needs a mesh, not points");
  if (!arguments.patches.empty()) write_patch_colors(arguments.patches, mesh, report.result.labels);
  std::vector<PrimitiveReport> reports;
  reports.push_back(std::move(report));
  return reports;
}

double bits_per_vertex(const PrimitiveReport& p) {
  return p.vertices ? 8.0 * double(p.bytes_after) / double(p.vertices) : 0;
}

Json json_of(const PrimitiveReport& p) {
  Json json = {{"name", p.name},
               {"compressed", p.compressed},
               {"reason", p.reason},
               {"vertices", p.vertices},
               {"triangles", p.triangles},
               {"bytes_before", p.bytes_before},
               {"bytes_after", p.bytes_after}};
  if (!p.compressed) return json;
  json["bits_per_vertex"] = bits_per_vertex(p);
  json["e_rms"] = p.result.error * 1e4;
  if (p.result.color_bytes > 0) {
    json["color_error"] = p.result.color_error;
    json["color_bytes"] = p.result.color_bytes;
  }
  json["target_met"] = p.result.target_met;
  json["patches"] = p.result.patches;
  json["warnings"] = p.result.warnings;
  json["seconds"] = Json::object();
  for (const auto& [stage, seconds] : p.result.seconds) json["seconds"][stage] = seconds;
  return json;
}

void print_json(const Arguments& arguments, const Encoded& encoded, bool target_met) {
  Json json = {{"input", arguments.in},
               {"output", arguments.out},
               {"input_bytes", file_bytes(arguments.in)},
               {"output_bytes", file_bytes(arguments.out)},
               {"seconds", encoded.seconds},
               {"target_met", target_met},
               {"primitives", Json::array()}};
  for (const PrimitiveReport& p : encoded.primitives) json["primitives"].push_back(json_of(p));
  std::printf("%s\n", json.dump(2).c_str());
}

void print_text(const Arguments& arguments, const Encoded& encoded) {
  for (const PrimitiveReport& p : encoded.primitives) {
    if (!p.compressed) continue;
    std::printf("%s: %s vertices, %s triangles -> %s bytes (%.3f bits a vertex), E_rms %.3f, %u patches\n",
                p.name.c_str(), with_commas(p.vertices).c_str(), with_commas(p.triangles).c_str(),
                with_commas(p.bytes_after).c_str(), bits_per_vertex(p), p.result.error * 1e4,
                p.result.patches);
    if (p.result.color_bytes > 0)
      std::printf("%s: colours take %s of the bytes, their rms error is %.2f of 255\n", p.name.c_str(),
                  with_commas(p.result.color_bytes).c_str(), p.result.color_error);
  }
  uint64_t before = file_bytes(arguments.in), after = file_bytes(arguments.out);
  std::printf("%s: %s bytes, 1/%.1f of %s, in %.1f s (E_rms: 1e-4 of the diagonal)\n", arguments.out.c_str(),
              with_commas(after).c_str(), after ? double(before) / double(after) : 0, arguments.in.c_str(),
              encoded.seconds);
}

// Lines on stderr about what was left out or repaired; returns whether all targets were met.
bool report_shortfalls(const Arguments& arguments, const std::vector<PrimitiveReport>& primitives) {
  constexpr size_t kMostLines = 20;
  bool target_met = true;
  size_t passed = 0;
  for (const PrimitiveReport& p : primitives) {
    for (const std::string& warning : p.result.warnings)
      note(arguments.common, arguments.in, p.name + ": warning: " + warning);
    if (!p.compressed && passed++ < kMostLines)
      note(arguments.common, arguments.in, p.name + ": passed through: " + p.reason);
    if (!p.compressed || p.result.target_met) continue;
    target_met = false;
    note(arguments.common, arguments.out,
         format("%s: the target could not be met; written: %s bytes with E_rms %.3f", p.name.c_str(),
                with_commas(p.bytes_after).c_str(), p.result.error * 1e4));
  }
  if (passed > kMostLines)
    note(arguments.common, arguments.in,
         format("%zu more primitives passed through (--json lists them)", passed - kMostLines));
  return target_met;
}

int run_encode(const Arguments& arguments) {
  check_output(arguments.out, {".glb", ".gltf", ".relief"});
  bool scene = is_gltf(arguments.in) && is_gltf(arguments.out);
  if (!arguments.patches.empty()) {
    check_output(arguments.patches, {".glb", ".gltf"});
    if (scene) throw UsageError("--patches needs a mesh file as input");
  }
  auto start = std::chrono::steady_clock::now();
  Encoded encoded;
  {
    ProgressBar bar(!arguments.common.quiet);
    encoded.primitives = about(
        arguments.in, [&] { return scene ? encode_scene(arguments, bar) : encode_mesh(arguments, bar); });
  }
  encoded.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  bool target_met = report_shortfalls(arguments, encoded.primitives);
  if (arguments.common.json)
    print_json(arguments, encoded, target_met);
  else if (!arguments.common.quiet)
    print_text(arguments, encoded);
  return target_met ? kDone : kTargetMissed;
}

void add_targets(CLI::App& command, Arguments& a) {
  CLI::Option* error =
      command
          .add_option(
              "--error", a.options.error,
              "Target: symmetric rms error, as a fraction of the bounding box diagonal (default 1e-4)")
          ->type_name("E")
          ->check(CLI::Range(1e-9, 1.0));
  CLI::Option* bytes = command
                           .add_option("--bytes", a.options.bytes,
                                       "Target: bytes of the stream; of several, shared by vertex count")
                           ->type_name("N")
                           ->check(CLI::Range(uint64_t(1), uint64_t(1) << 40));
  CLI::Option* bpv =
      command.add_option("--bpv", a.options.bits_per_vertex, "Target: bits per vertex of the input")
          ->type_name("R")
          ->check(CLI::Range(1e-6, 1e3));
  error->excludes(bytes)->excludes(bpv);
  bytes->excludes(bpv);
}

void add_choice(CLI::App& command, const char* name, std::string& choice, const char* text,
                const std::vector<std::string>& names) {
  command.add_option(name, choice, text)->type_name("NAME")->check(CLI::IsMember(names));
}

void add_choices(CLI::App& command, Arguments& a) {
  add_choice(command, "--coder", a.coder,
             "subband: the fewest bytes (default); bisk: bit planes, to be cut at any byte",
             {"subband", "bisk"});
  add_choice(command, "--allocation", a.allocation,
             "Of bisk, bits go where they lower the error most: rd (default); or evenly: even",
             {"rd", "even"});
  add_choice(command, "--partition", a.partition,
             "Patches by Lloyd's algorithm: gla (default); or by splitting and merging: split-merge",
             {"gla", "split-merge"});
  add_choice(command, "--plane", a.plane,
             "A patch's plane by the average of its normals (default), or their smallest cone: cone",
             {"average", "cone"});
}

}  // namespace

void add_encode(CLI::App& app, Run& run) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "encode", "Compress a mesh, a point cloud, or every primitive of a scene that can be coded");
  command->footer(
      "  relief encode scan.ply scan.glb                    rms error of 1e-4 of the diagonal\n"
      "  relief encode scan.ply scan.glb --error 5e-5       half of that\n"
      "  relief encode scene.glb small.glb --bytes 100000   as good as 100,000 bytes allow\n"
      "  relief encode cloud.xyz cloud.glb                  a point cloud: its surface; see decode --points\n"
      "\n"
      "Primitives of a scene that carry what is not coded yet (texture coordinates, joints, morph targets) "
      "and\n"
      "those that touch another one of their mesh pass through unchanged, and a line says so.");
  command->add_option("IN", a->in, ".ply .obj .off .stl .xyz .pcd .glb .gltf .relief")->required();
  command->add_option("OUT", a->out, ".glb .gltf .relief")->required();
  add_targets(*command, *a);
  add_choices(*command, *a);
  command
      ->add_option("--aperture", a->options.aperture,
                   "Largest angle between a patch's normals and its plane's (default 80)")
      ->type_name("DEG")
      ->check(CLI::Range(1.0, 89.0));
  command
      ->add_option("--density", a->options.density,
                   "Grid spacing over that of the patch's vertices (default: by rate-distortion)")
      ->type_name("MU")
      ->check(CLI::Range(0.05, 100.0));
  command
      ->add_option("--min-component", a->options.min_component,
                   "Drop connected components of fewer triangles (default: keep all)")
      ->type_name("N");
  command->add_flag("--drop-handles", a->drop_handles,
                    "Let handles close that are smaller than the grid: saves 2 to 4 bytes each");
  command->add_option("--effort", a->options.effort, "1 (fast) to 9 (fewer bytes, much slower); default 5")
      ->type_name("1..9")
      ->check(CLI::Range(1, 9));
  CLI::Option* color_error =
      command
          ->add_option("--color-error", a->options.color_error,
                       "Colours of vertices: rms error, of 255 (default 4); with --bytes or --bpv they take "
                       "what the surface leaves")
          ->type_name("N")
          ->check(CLI::Range(0.1, 255.0));
  command->add_flag("--no-colors", a->no_colors, "Leave colours out")->excludes(color_error);
  command->add_flag("--no-fit", a->no_fit, "Sample elevations instead of fitting them by least squares");
  command->add_option("--patches", a->patches, "Also write the input, coloured by patch (.glb)")
      ->type_name("FILE");
  add_common(*command, a->common);
  command->callback(
      [a, &run] { run = [a] { return with_threads(a->common, [a] { return run_encode(*a); }); }; });
}

}  // namespace relief::cli
