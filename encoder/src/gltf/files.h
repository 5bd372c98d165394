// Whole files in and out. Output goes to a temporary name in the same folder and is renamed when complete.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "relief/encoder.h"

namespace relief {

using Bytes = std::vector<uint8_t>;

// A file that cannot be read or written, which need not be the one that was asked for (the buffer of a
// .gltf).
struct FileError : InputError {
  FileError(const std::filesystem::path& file, const std::string& what)
      : InputError(what), path(file.string()) {}
  std::string path;
};

Bytes read_file(const std::filesystem::path& path);

// Files that appear together: all temporary files are complete before the first is renamed.
struct OutputFile {
  std::filesystem::path path;
  std::vector<const Bytes*> parts;  // written one after the other
};
void write_files(const std::vector<OutputFile>& files);
void write_file(const std::filesystem::path& path, const Bytes& bytes);

// The extension in lower case, with its dot.
std::string lower_extension(const std::filesystem::path& path);

}  // namespace relief
