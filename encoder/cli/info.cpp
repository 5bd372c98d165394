#include <memory>

#include "code/ledger.h"
#include "common.h"
#include "gltf/gltf.h"
#include "relief/relief.h"

namespace relief::cli {

namespace {

struct Arguments {
  Common common;
  std::string file;
  bool patches = false;
};

struct Stream {
  size_t bytes;
  relief_info info;
  Ledger ledger;
};

Stream read_stream(const Bytes& bytes) {
  Stream stream{bytes.size(), {}, {}};
  relief_status status = relief_inspect(bytes.data(), bytes.size(), nullptr, &stream.info);
  if (status != RELIEF_OK) throw InputError(relief_status_text(status));
  stream.ledger = read_ledger(bytes);
  return stream;
}

Json json_of(const Stream& s) {
  Json json = {{"bytes", s.bytes},
               {"version", s.info.version},
               {"patch_count", s.info.patch_count},
               {"pixel_count", s.info.pixel_count},
               {"vertex_count", s.info.vertex_count},
               {"triangle_count", s.info.triangle_count},
               {"vertex_capacity", s.info.vertex_capacity},
               {"triangle_capacity", s.info.triangle_capacity},
               {"workspace_bytes", s.info.workspace_bytes},
               {"origin", s.info.origin},
               {"scale", s.info.scale},
               {"masks_end", s.info.masks_end},
               {"bytes_header", s.ledger.header},
               {"bytes_seams", s.ledger.seams},
               {"bytes_colours", s.ledger.colours},
               {"has_colors", s.info.has_colors == 1},
               {"bytes_side", s.ledger.side},
               {"bytes_masks", s.ledger.masks},
               {"bytes_coefficients", s.ledger.coefficients},
               {"bytes_by_level", s.ledger.by_level},
               {"bytes_by_band", Json::array()},
               {"bytes_by_plane", s.ledger.by_plane},
               {"patches", Json::array()}};
  for (const auto& level : s.ledger.by_band) {  // as bytes_by_level: the coarsest first
    Json& bands = json["bytes_by_band"].emplace_back(Json::object());
    for (int band = 0; band < Ledger::kBands; band++) bands[Ledger::kBandNames[band]] = level[size_t(band)];
  }
  for (const Ledger::P& p : s.ledger.patches)
    json["patches"].push_back({{"width", p.width},
                               {"height", p.height},
                               {"pixels", p.pixels},
                               {"spacing", p.spacing},
                               {"normal", p.normal},
                               {"bytes_masks", p.masks},
                               {"bytes_coefficients", p.coefficients}});
  return json;
}

void print_share(const char* what, uint64_t bytes, size_t all) {
  std::printf("  %-24s %12s  %5.1f%%\n", what, with_commas(bytes).c_str(),
              100.0 * double(bytes) / double(all));
}

void print_patches(const Ledger& ledger) {
  std::printf("  %6s %6s %6s %8s %8s %12s %12s  %s\n", "patch", "width", "height", "pixels", "masks",
              "coefficients", "spacing", "normal");
  for (size_t i = 0; i < ledger.patches.size(); i++) {
    const Ledger::P& p = ledger.patches[i];
    std::printf("  %6zu %6u %6u %8u %8s %12s %12.6g  %6.3f %6.3f %6.3f\n", i, p.width, p.height, p.pixels,
                with_commas(p.masks).c_str(), with_commas(p.coefficients).c_str(), p.spacing, p.normal[0],
                p.normal[1], p.normal[2]);
  }
}

void print_text(const Stream& s, bool patches) {
  std::printf("%s bytes, version %u, %u patches, %s vertices, %s triangles, %s pixels in rectangles\n",
              with_commas(s.bytes).c_str(), s.info.version, s.info.patch_count,
              with_commas(s.info.vertex_count).c_str(), with_commas(s.info.triangle_count).c_str(),
              with_commas(s.info.pixel_count).c_str());
  std::printf("decoding needs %s bytes of workspace; a prefix has all patches from %s bytes on\n",
              with_commas(s.info.workspace_bytes).c_str(), with_commas(s.info.masks_end).c_str());
  print_share("header", s.ledger.header, s.bytes);
  print_share("side information", s.ledger.side, s.bytes);
  print_share("masks", s.ledger.masks, s.bytes);
  print_share("coefficients", s.ledger.coefficients, s.bytes);
  for (size_t level = 0; level < s.ledger.by_level.size(); level++)
    print_share(format("  level %zu%s", level, level == 0 ? " (coarsest)" : "").c_str(),
                s.ledger.by_level[level], s.bytes);
  for (size_t plane = s.ledger.by_plane.size(), i = 0; i < s.ledger.by_plane.size(); i++)
    print_share(format("  bit plane %zu", plane - 1 - i).c_str(), s.ledger.by_plane[i], s.bytes);
  print_share("seams", s.ledger.seams, s.bytes);
  if (s.info.has_colors) print_share("colours", s.ledger.colours, s.bytes);
  if (patches) print_patches(s.ledger);
}

int run_info(const Arguments& arguments) {
  if (!is_gltf(arguments.file) && lower_extension(arguments.file) != ".relief")
    throw FileError(arguments.file, "is not a .glb, .gltf or .relief file");
  std::vector<Stream> streams;
  about(arguments.file, [&] {
    for (const Bytes& bytes : read_streams(arguments.file)) streams.push_back(read_stream(bytes));
  });
  if (streams.empty()) throw FileError(arguments.file, "holds nothing that is compressed with Relief");
  if (arguments.common.json) {
    Json json = {{"file", arguments.file}, {"bytes", file_bytes(arguments.file)}, {"streams", Json::array()}};
    for (const Stream& stream : streams) json["streams"].push_back(json_of(stream));
    std::printf("%s\n", json.dump(2).c_str());
    return kDone;
  }
  std::printf("%s: %s bytes\n", arguments.file.c_str(), with_commas(file_bytes(arguments.file)).c_str());
  for (size_t i = 0; i < streams.size(); i++) {
    std::printf("stream %zu: ", i);
    print_text(streams[i], arguments.patches);
  }
  return kDone;
}

}  // namespace

void add_info(CLI::App& app, Run& run) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("info", "Tell what a compressed file holds and where its bytes go");
  command->footer(
      "  relief info scan.glb             bytes by kind and by wavelet level\n"
      "  relief info scan.glb --patches   and a line for every patch, with its bytes");
  command->add_option("FILE", a->file, ".glb .gltf .relief")->required();
  command->add_flag("--patches", a->patches, "A line for every patch");
  add_common(*command, a->common);
  command->callback(
      [a, &run] { run = [a] { return with_threads(a->common, [a] { return run_info(*a); }); }; });
}

}  // namespace relief::cli
