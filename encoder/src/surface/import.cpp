#include "surface/import.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

#include "gltf/read_mesh.h"
#include "surface/polygons.h"
#include "surface/readers.h"

namespace relief {
namespace {

std::string read_file(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) throw InputError("is a folder");
  std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) throw InputError(std::string("cannot be opened: ") + std::strerror(errno));
  std::string bytes;
  size_t size = std::filesystem::file_size(path, error);
  if (!error) bytes.reserve(size + 1);
  for (size_t got = 1; got > 0;) {  // until the end: the size is not known for pipes
    size_t old = bytes.size();
    bytes.resize(std::max(bytes.capacity(), old + (1 << 16)));
    got = std::fread(bytes.data() + old, 1, bytes.size() - old, file.get());
    bytes.resize(old + got);
  }
  if (std::ferror(file.get())) throw InputError(std::string("cannot be read: ") + std::strerror(errno));
  if (bytes.empty()) throw InputError("is an empty file");
  return bytes;
}

}  // namespace

TriangleMesh read_mesh(const std::string& path, const DecodeOptions& options) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  TriangleMesh mesh;
  bool may_be_points = true;
  if (extension == ".ply") {
    mesh = read_ply(read_file(path));
  } else if (extension == ".xyz") {
    mesh = read_xyz(read_file(path));
  } else if (extension == ".pcd") {
    mesh = read_pcd(read_file(path));
  } else if (extension == ".glb" || extension == ".gltf") {
    mesh = read_gltf_mesh(path, options);
  } else {
    may_be_points = false;
    if (extension == ".obj")
      mesh = read_obj(read_file(path));
    else if (extension == ".off")
      mesh = read_off(read_file(path));
    else if (extension == ".stl")
      mesh = read_stl(read_file(path));
    else
      throw InputError("unknown format '" + extension +
                       "' (known: .ply .xyz .pcd .obj .off .stl .glb .gltf)");
  }
  check_mesh(mesh);
  if (mesh.triangles.empty() && !may_be_points) throw InputError("has no faces");
  return mesh;
}

}  // namespace relief
