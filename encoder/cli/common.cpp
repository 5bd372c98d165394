#include "common.h"

#include <tbb/global_control.h>
#include <unistd.h>

#include <cstdarg>
#include <cstdio>
#include <filesystem>

#include "gltf/gltf.h"
#include "surface/import.h"

namespace relief::cli {

void add_common(CLI::App& command, Common& common) {
  command.add_flag("--json", common.json, "Print the results as JSON");
  command.add_flag("--quiet,-q", common.quiet, "Print nothing but errors (and JSON, if asked for)");
  command.add_option("--threads", common.threads, "Threads to use (default: all cores)")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
}

int with_threads(const Common& common, const std::function<int()>& f) {
  if (common.threads == 0) return f();
  tbb::global_control limit(tbb::global_control::max_allowed_parallelism, size_t(common.threads));
  return f();
}

TriangleMesh load_mesh(const std::string& path, const DecodeOptions& options) {
  return about(path, [&] {
    if (lower_extension(path) != ".relief") return read_mesh(path, options);
    Bytes stream = read_file(path);
    return decode(stream.data(), stream.size(), options);
  });
}

bool is_gltf(const std::string& path) {
  std::string extension = lower_extension(path);
  return extension == ".glb" || extension == ".gltf";
}

void check_output(const std::string& out, std::initializer_list<const char*> extensions) {
  bool known = false;
  std::string list;
  for (const char* extension : extensions) {
    known = known || lower_extension(out) == extension;
    list += list.empty() ? extension : std::string(", ") + extension;
  }
  if (!known) throw UsageError(out + ": the output must end in one of " + list);
  std::filesystem::path folder = std::filesystem::path(out).parent_path();
  if (!folder.empty() && !std::filesystem::is_directory(folder))
    throw FileError(out, "its folder does not exist");
}

void note(const Common& common, const std::string& path, const std::string& text) {
  if (!common.quiet) std::fprintf(stderr, "relief: %s: %s\n", path.c_str(), text.c_str());
}

std::string format(const char* pattern, ...) {
  char text[1024];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof(text), pattern, arguments);
  va_end(arguments);
  return text;
}

std::string with_commas(uint64_t value) {
  std::string digits = std::to_string(value);
  for (int at = int(digits.size()) - 3; at > 0; at -= 3) digits.insert(size_t(at), 1, ',');
  return digits;
}

uint64_t file_bytes(const std::string& path) {
  auto size_of = [](const std::filesystem::path& file) -> uint64_t {
    std::error_code error;
    uintmax_t size = std::filesystem::file_size(file, error);
    return error ? 0 : size;
  };
  uint64_t size = size_of(path);
  if (lower_extension(path) == ".gltf")
    size += size_of(std::filesystem::path(path).replace_extension(".bin"));
  return size;
}

ProgressBar::ProgressBar(bool wanted) : shown_(wanted && isatty(STDERR_FILENO)) {}

ProgressBar::~ProgressBar() {
  if (drawn_) std::fputs("\r\033[K", stderr);
}

void ProgressBar::show(const char* stage, double done) {
  if (!shown_) return;
  int percent = int(100 * done);
  if (percent == last_percent_) return;
  last_percent_ = percent;
  drawn_ = true;
  constexpr int kWidth = 40;
  std::string bar(size_t(kWidth * percent / 100), '#');
  bar.resize(kWidth, '.');
  std::fprintf(stderr, "\r[%s] %3d%% %s\033[K", bar.c_str(), percent, stage);
  std::fflush(stderr);
}

}  // namespace relief::cli
