// What the fuzz targets of the readers of mesh files check of every input.
#pragma once
#include <cstdio>
#include <cstdlib>

#include "surface/polygons.h"
#include "surface/readers.h"
#include "target.h"

namespace relief {

// As read_mesh does with the bytes of a file: an InputError of one line, or a mesh that is what a reader
// promises.
template <class Reader>
bool read_and_check(Reader reader, const uint8_t* data, size_t size) {
  const auto check = [](bool good, const char* fault) {
    if (good) return;
    std::fprintf(stderr, "%s\n", fault);
    std::abort();
  };
  try {
    const TriangleMesh mesh = reader(std::string_view(reinterpret_cast<const char*>(data), size));
    check_mesh(mesh);
    for (const auto& t : mesh.triangles)
      for (uint32_t i : t) check(i < mesh.positions.size(), "an index is out of range");
    check(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size(), "a vertex has no normal");
    check(mesh.colors.empty() || mesh.colors.size() == mesh.positions.size(), "a vertex has no colour");
    return true;
  } catch (const InputError& e) {
    const std::string_view line = e.what();
    check(!line.empty() && line.find('\n') == line.npos, "the message is not one line");
    return false;
  }
}

}  // namespace relief
