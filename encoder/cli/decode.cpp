#include <chrono>
#include <memory>

#include "common.h"
#include "gltf/gltf.h"
#include "relief/relief.h"
#include "surface/import.h"

namespace relief::cli {

namespace {

struct Arguments {
  Common common;
  std::string in, out;
  DecodeOptions options;
};

struct Decoded {
  size_t primitives = 0;  // that were compressed
  uint64_t vertices = 0, triangles = 0;
};

void count(Decoded& decoded, const Arguments& arguments) {
  for (const Bytes& stream : read_streams(arguments.in)) {
    TriangleMesh mesh = decode(stream.data(), stream.size(), arguments.options);
    decoded.vertices += mesh.positions.size();
    decoded.triangles += mesh.triangles.size();
  }
}

Decoded decode_file(const Arguments& arguments) {
  Decoded decoded;
  if (is_gltf(arguments.in) && is_gltf(arguments.out)) {
    decoded.primitives = decompress_gltf(arguments.in, arguments.out, arguments.options);
    count(decoded, arguments);
    return decoded;
  }
  TriangleMesh mesh = load_mesh(arguments.in, arguments.options);
  decoded.primitives = is_gltf(arguments.in) ? read_streams(arguments.in).size() : 1;
  decoded.vertices = mesh.positions.size();
  decoded.triangles = mesh.triangles.size();
  about(arguments.out, [&] {
    if (is_gltf(arguments.out))
      write_mesh_gltf(arguments.out, mesh);
    else if (arguments.options.points)
      write_points(arguments.out, mesh);
    else
      write_mesh(arguments.out, mesh);
  });
  return decoded;
}

int run_decode(const Arguments& arguments) {
  if (arguments.options.points)
    check_output(arguments.out, {".glb", ".gltf", ".ply", ".obj", ".xyz"});
  else
    check_output(arguments.out, {".glb", ".gltf", ".ply", ".obj"});
  if (!is_gltf(arguments.in) && lower_extension(arguments.in) != ".relief")
    throw FileError(arguments.in, "is not a .glb, .gltf or .relief file");
  auto start = std::chrono::steady_clock::now();
  Decoded decoded = about(arguments.in, [&] { return decode_file(arguments); });
  double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (decoded.primitives == 0)
    note(arguments.common, arguments.in, "holds nothing that is compressed; passed through");
  if (arguments.common.json) {
    Json json = {{"input", arguments.in},
                 {"output", arguments.out},
                 {"input_bytes", file_bytes(arguments.in)},
                 {"output_bytes", file_bytes(arguments.out)},
                 {"primitives", decoded.primitives},
                 {"vertices", decoded.vertices},
                 {"triangles", decoded.triangles},
                 {"seconds", seconds}};
    std::printf("%s\n", json.dump(2).c_str());
  } else if (!arguments.common.quiet) {
    std::printf("%s: %s vertices, %s triangles, %s bytes, in %.2f s\n", arguments.out.c_str(),
                with_commas(decoded.vertices).c_str(), with_commas(decoded.triangles).c_str(),
                with_commas(file_bytes(arguments.out)).c_str(), seconds);
  }
  return kDone;
}

}  // namespace

void add_decode(CLI::App& app, Run& run) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("decode", "Turn compressed surfaces back into triangles");
  command->footer(
      "  relief decode scan.glb scan.ply       all triangles of the scene\n"
      "  relief decode scene.glb plain.glb     the scene, without compression\n"
      "  relief decode scan.relief scan.obj    a bare stream\n"
      "  relief decode scan.glb a.ply --bytes 9000   what the first 9000 bytes of the stream hold\n"
      "  relief decode scan.glb a.ply --level 2      a sixteenth of the triangles\n"
      "  relief decode cloud.glb a.ply --points      points with normals");
  command->add_option("IN", a->in, ".glb .gltf .relief")->required();
  command->add_option("OUT", a->out, ".glb .gltf .ply .obj; points: .xyz as well")->required();
  command
      ->add_option(
          "--bytes", a->options.bytes,
          "Use only the first N bytes of each stream: a coarser surface (relief info tells from where on "
          "it has all patches)")
      ->type_name("N")
      ->check(CLI::Range(uint64_t(1), UINT64_MAX));
  command
      ->add_option("--level", a->options.level,
                   "A grid coarser by 2^L: about 4^L times fewer triangles, and less time")
      ->type_name("L")
      ->check(CLI::Range(0, RELIEF_MAX_LEVEL));
  auto* smooth =
      command->add_flag("--smooth", a->options.smooth,
                        "Smooth the seams between patches: for very coarse streams, where they show");
  command
      ->add_flag("--points", a->options.points,
                 "Points instead of triangles: the vertices of the patches, nothing between them")
      ->excludes(smooth);
  add_common(*command, a->common);
  command->callback(
      [a, &run] { run = [a] { return with_threads(a->common, [a] { return run_decode(*a); }); }; });
}

}  // namespace relief::cli
