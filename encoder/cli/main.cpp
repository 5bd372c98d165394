// relief: the command line.
#include <cstdio>
#include <exception>
#include <string_view>

#include "common.h"
#include "large_pages.h"

using namespace relief;
using namespace relief::cli;

static int fail(int code, const std::string& text) {
  std::string line = text;
  for (char& c : line)
    if (c == '\n' || c == '\r') c = ' ';
  std::fprintf(stderr, "relief: %s\n", line.c_str());
  return code;
}

static int parse_and_run(int argc, char** argv) {
  CLI::App app{"Relief compresses dense 3D surfaces inside glTF (RELIEF_patch_compression)."};
  app.footer(
      "  relief encode scan.ply scan.glb      compress to an rms error of 1e-4 of the diagonal\n"
      "  relief decode scan.glb back.ply      get the surface back\n"
      "  relief compare scan.ply scan.glb     measure the error and the topology\n"
      "  relief info scan.glb                 see where the bytes went\n"
      "\n"
      "relief COMMAND --help tells more. Exit codes: 0 done, 1 the input is at fault, 2 the command line "
      "is,\n"
      "3 the target could not be met (the best result is written), 4 a fault of ours.");
  app.name("relief");
  app.set_version_flag("--version", "relief " RELIEF_VERSION);
  Run run;
  add_encode(app, run);
  add_decode(app, run);
  add_compare(app, run);
  add_info(app, run);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);  // --help, --version
    return fail(kUsageFault, std::string(e.what()) + " (see relief --help)");
  }
  if (!run) return fail(kUsageFault, "say what to do: encode, decode, compare or info (see relief --help)");
  return run();
}

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "encode") prefer_large_pages(argv);
  try {
    return parse_and_run(argc, argv);
  } catch (const FileError& e) {
    return fail(kInputFault, e.path + ": " + e.what());
  } catch (const InputError& e) {
    return fail(kInputFault, e.what());
  } catch (const UsageError& e) {
    return fail(kUsageFault, e.what());
  } catch (const std::bad_alloc&) {
    return fail(kOurFault, "out of memory");
  } catch (const std::exception& e) {
    return fail(kOurFault, std::string("internal error: ") + e.what());
  }
}
