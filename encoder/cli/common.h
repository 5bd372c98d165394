// What the commands share.
#pragma once
#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "gltf/document.h"
#include "relief/encoder.h"

namespace relief::cli {

// Exit codes of the program.
enum Exit { kDone = 0, kInputFault = 1, kUsageFault = 2, kTargetMissed = 3, kOurFault = 4 };

// The command line is at fault, beyond what CLI11 can see.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Common {
  bool json = false, quiet = false;
  int threads = 0;  // 0: all cores
};
void add_common(CLI::App& command, Common& common);

// Each adds its command; parsing sets `run` to what it does, which returns an exit code.
using Run = std::function<int()>;
void add_encode(CLI::App& app, Run& run);
void add_decode(CLI::App& app, Run& run);
void add_compare(CLI::App& app, Run& run);
void add_info(CLI::App& app, Run& run);

// Calls f with TBB held to common.threads threads.
int with_threads(const Common& common, const std::function<int()>& f);

// Calls f; an InputError that does not name a file comes out as one of `path`.
template <typename F>
auto about(const std::string& path, F f) {
  try {
    return f();
  } catch (const FileError&) {
    throw;
  } catch (const InputError& e) {
    throw FileError(path, e.what());
  }
}

// Any mesh or scene as triangles in world space, or what a .relief stream decodes to.
TriangleMesh load_mesh(const std::string& path, const DecodeOptions& options = {});

bool is_gltf(const std::string& path);

// Throws before any work is done if `out` has none of the extensions or its folder does not exist.
void check_output(const std::string& out, std::initializer_list<const char*> extensions);

// A line on stderr: "relief: FILE: text".
void note(const Common& common, const std::string& path, const std::string& text);

std::string format(const char* pattern, ...) __attribute__((format(printf, 1, 2)));
std::string with_commas(uint64_t value);
// Of a .gltf: with the .bin of the same name, if there is one.
uint64_t file_bytes(const std::string& path);

// A bar on stderr, if that is a terminal.
class ProgressBar {
 public:
  explicit ProgressBar(bool wanted);
  ~ProgressBar();
  void show(const char* stage, double done);

 private:
  bool shown_, drawn_ = false;
  int last_percent_ = -1;
};

}  // namespace relief::cli
