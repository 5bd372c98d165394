// Writers behind write_mesh (import.h): PLY binary, OBJ; GLB is in gltf/.
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "gltf/gltf.h"
#include "surface/import.h"

namespace relief {
namespace {

// The shortest text that reads back as the same number.
template <class Number>
void append_number(std::string& out, Number value) {
  char text[32];
  out.append(text, std::to_chars(text, text + sizeof(text), value).ptr);
}

void append_bytes(std::string& out, const void* data, size_t size) {
  out.append(static_cast<const char*>(data), size);
}

std::string ply_bytes(const TriangleMesh& mesh) {
  const bool normals = !mesh.normals.empty(), colors = !mesh.colors.empty();
  std::string out = "ply\nformat binary_little_endian 1.0\ncomment Relief\nelement vertex ";
  append_number(out, mesh.positions.size());
  out += "\nproperty float x\nproperty float y\nproperty float z\n";
  if (colors) out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (normals) out += "property float nx\nproperty float ny\nproperty float nz\n";
  if (!mesh.triangles.empty()) {
    out += "element face ";
    append_number(out, mesh.triangles.size());
    out += "\nproperty list uchar uint vertex_indices\n";
  }
  out += "end_header\n";
  out.reserve(out.size() + mesh.positions.size() * (normals ? 24 : 12) + mesh.triangles.size() * 13);
  for (size_t i = 0; i < mesh.positions.size(); i++) {
    append_bytes(out, mesh.positions[i].data(), 12);
    if (colors) append_bytes(out, mesh.colors[i].data(), 3);
    if (normals) append_bytes(out, mesh.normals[i].data(), 12);
  }
  for (const auto& t : mesh.triangles) {
    out += char(3);
    append_bytes(out, t.data(), 12);
  }
  return out;
}

std::string obj_bytes(const TriangleMesh& mesh) {
  std::string out = "# Relief\n";
  auto vector = [&out](const char* keyword, const std::array<float, 3>& v) {
    out += keyword;
    for (float c : v) out += ' ', append_number(out, c);
  };
  for (size_t i = 0; i < mesh.positions.size(); i++) {
    vector("v", mesh.positions[i]);
    for (size_t k = 0; k < 3 && !mesh.colors.empty(); k++)
      out += ' ', append_number(out, float(mesh.colors[i][k]) / 255);
    out += '\n';
  }
  for (const auto& n : mesh.normals) vector("vn", n), out += '\n';
  for (const auto& t : mesh.triangles) {
    out += 'f';
    for (uint32_t i : t) {
      out += ' ', append_number(out, i + 1);
      if (!mesh.normals.empty()) out += "//", append_number(out, i + 1);
    }
    out += '\n';
  }
  return out;
}

// Of a point cloud.
std::string xyz_bytes(const TriangleMesh& cloud) {
  std::string out;
  for (size_t i = 0; i < cloud.positions.size(); i++) {
    const char* between = "";
    auto vector = [&](const std::array<float, 3>& v) {
      for (float c : v) out += between, append_number(out, c), between = " ";
    };
    vector(cloud.positions[i]);
    if (!cloud.normals.empty()) vector(cloud.normals[i]);
    for (size_t k = 0; k < 3 && !cloud.colors.empty(); k++)
      out += ' ', append_number(out, unsigned(cloud.colors[i][k]));
    out += '\n';
  }
  return out;
}

// A reader sees the old file or the whole new one, never a part.
void write_atomically(const std::string& path, const std::string& bytes) {
  std::string temporary = path + ".tmp" + std::to_string(getpid());
  FILE* file = std::fopen(temporary.c_str(), "wb");
  if (!file) throw InputError(std::string("cannot be written: ") + std::strerror(errno));
  bool good = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  good = std::fclose(file) == 0 && good;
  if (good && std::rename(temporary.c_str(), path.c_str()) == 0) return;
  std::string reason = std::strerror(errno);
  std::remove(temporary.c_str());
  throw InputError("cannot be written: " + reason);
}

std::string extension_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return extension;
}

}  // namespace

void write_points(const std::string& path, const TriangleMesh& mesh) {
  if (!mesh.triangles.empty()) throw InputError("these are not points");
  std::string extension = extension_of(path);
  if (extension == ".ply") return write_atomically(path, ply_bytes(mesh));
  if (extension == ".obj") return write_atomically(path, obj_bytes(mesh));
  if (extension == ".xyz") return write_atomically(path, xyz_bytes(mesh));
  throw InputError("unknown format '" + extension + "' to write points (known: .ply .obj .xyz)");
}

void write_mesh(const std::string& path, const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) throw InputError("there are no triangles to write");
  std::string extension = extension_of(path);
  if (extension == ".ply") return write_atomically(path, ply_bytes(mesh));
  if (extension == ".obj") return write_atomically(path, obj_bytes(mesh));
  if (extension == ".glb") return write_mesh_gltf(path, mesh);
  throw InputError("unknown format '" + extension + "' to write (known: .ply .obj .glb)");
}

}  // namespace relief
