#include "gltf/files.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace relief {

namespace fs = std::filesystem;

Bytes read_file(const fs::path& path) {
  std::error_code error;
  fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) throw FileError(path, "no such file");
  if (!fs::is_regular_file(status)) throw FileError(path, "is not a regular file");
  uintmax_t size = fs::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in) throw FileError(path, std::string("cannot be opened: ") + std::strerror(errno));
  Bytes bytes(size);
  in.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(size));
  if (uintmax_t(in.gcount()) != size) throw FileError(path, "cannot be read to its end");
  return bytes;
}

static fs::path temporary_name(const fs::path& path) {
  fs::path name = path;
  name += ".tmp" + std::to_string(getpid());
  return name;
}

static void write_temporary(const OutputFile& file) {
  std::ofstream out(temporary_name(file.path), std::ios::binary | std::ios::trunc);
  for (const Bytes* part : file.parts)
    out.write(reinterpret_cast<const char*>(part->data()), std::streamsize(part->size()));
  out.close();
  if (!out) throw FileError(file.path, std::string("cannot be written: ") + std::strerror(errno));
}

void write_files(const std::vector<OutputFile>& files) {
  std::error_code ignored;
  try {
    for (const OutputFile& file : files) {
      if (fs::is_directory(file.path, ignored)) throw FileError(file.path, "is a folder");
      write_temporary(file);
    }
    for (const OutputFile& file : files) {
      std::error_code error;
      fs::rename(temporary_name(file.path), file.path, error);
      if (error) throw FileError(file.path, "cannot be written: " + error.message());
    }
  } catch (...) {
    for (const OutputFile& file : files) fs::remove(temporary_name(file.path), ignored);
    throw;
  }
}

void write_file(const fs::path& path, const Bytes& bytes) { write_files({{path, {&bytes}}}); }

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = char(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

}  // namespace relief
