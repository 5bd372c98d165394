// Writers behind write_mesh (import.h): PLY binary, OBJ, plain GLB.
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>

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
  auto vectors = [&out](const char* keyword, const std::vector<std::array<float, 3>>& list) {
    for (const auto& v : list) {
      out += keyword;
      for (float c : v) out += ' ', append_number(out, c);
      out += '\n';
    }
  };
  vectors("v", mesh.positions);
  vectors("vn", mesh.normals);
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

// The JSON chunk of a scene of one node, one mesh, one primitive; offsets are in the binary chunk.
std::string glb_json(const TriangleMesh& mesh) {
  size_t vectors = mesh.positions.size() * 12, normals = mesh.normals.size() * 12;
  size_t indices = mesh.triangles.size() * 12;
  std::string views, accessors, bounds[2];
  size_t view = 0;
  auto add = [&](size_t offset, size_t bytes, int target, size_t count, const char* type) {
    if (view > 0) views += ',', accessors += ',';
    views += "{\"buffer\":0,\"byteOffset\":" + std::to_string(offset) +
             ",\"byteLength\":" + std::to_string(bytes) + ",\"target\":" + std::to_string(target) + "}";
    accessors +=
        "{\"bufferView\":" + std::to_string(view++) + ",\"count\":" + std::to_string(count) + "," + type;
  };
  for (int k = 0; k < 3; k++) {
    auto less = [k](const auto& a, const auto& b) { return a[k] < b[k]; };
    auto [low, high] = std::minmax_element(mesh.positions.begin(), mesh.positions.end(), less);
    for (int side = 0; side < 2; side++) {
      if (k) bounds[side] += ',';
      append_number(bounds[side], double((side ? *high : *low)[k]));  // as a double: exactly the float
    }
  }
  add(0, vectors, 34962, mesh.positions.size(), "\"componentType\":5126,\"type\":\"VEC3\"");
  accessors += ",\"min\":[" + bounds[0] + "],\"max\":[" + bounds[1] + "]}";
  if (normals) {
    add(vectors, normals, 34962, mesh.normals.size(), "\"componentType\":5126,\"type\":\"VEC3\"");
    accessors += "}";
  }
  add(vectors + normals, indices, 34963, mesh.triangles.size() * 3,
      "\"componentType\":5125,\"type\":\"SCALAR\"");
  accessors += "}";
  std::string json = "{\"asset\":{\"version\":\"2.0\",\"generator\":\"Relief\"},\"scene\":0,";
  json += "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[{";
  json += normals ? "\"attributes\":{\"POSITION\":0,\"NORMAL\":1},\"indices\":2"
                  : "\"attributes\":{\"POSITION\":0},\"indices\":1";
  json += "}]}],\"accessors\":[" + accessors + "],\"bufferViews\":[" + views;
  json += "],\"buffers\":[{\"byteLength\":" + std::to_string(vectors + normals + indices) + "}]}";
  return json;
}

std::string glb_bytes(const TriangleMesh& mesh) {
  std::string json = glb_json(mesh);
  json.resize((json.size() + 3) / 4 * 4, ' ');
  uint64_t binary = (mesh.positions.size() + mesh.normals.size() + mesh.triangles.size()) * 12;
  uint64_t total = 12 + 8 + json.size() + 8 + binary;
  if (total > std::numeric_limits<uint32_t>::max())
    throw InputError("the mesh is too large for a GLB file of 4 GB");
  std::string out;
  out.reserve(total);
  auto append_words = [&out](std::initializer_list<uint32_t> words) {
    for (uint32_t w : words) append_bytes(out, &w, 4);
  };
  append_words({0x46546c67u, 2, uint32_t(total), uint32_t(json.size()), 0x4e4f534au});
  out += json;
  append_words({uint32_t(binary), 0x004e4942u});
  append_bytes(out, mesh.positions.data(), mesh.positions.size() * 12);
  append_bytes(out, mesh.normals.data(), mesh.normals.size() * 12);
  append_bytes(out, mesh.triangles.data(), mesh.triangles.size() * 12);
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
  if (extension == ".glb") return write_atomically(path, glb_bytes(mesh));
  throw InputError("unknown format '" + extension + "' to write (known: .ply .obj .glb)");
}

}  // namespace relief
