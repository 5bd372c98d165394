// The readers behind read_mesh (import.h): each takes a whole file's bytes. All throw InputError with one
// line that says what is wrong and where; counts are checked against the file's size before anything is sized
// by them.
#pragma once
#include <string_view>

#include "relief/encoder.h"

namespace relief {

TriangleMesh read_ply(std::string_view bytes);
TriangleMesh read_obj(std::string_view bytes);
TriangleMesh read_off(std::string_view bytes);
TriangleMesh read_stl(std::string_view bytes);
TriangleMesh read_xyz(std::string_view bytes);
TriangleMesh read_pcd(std::string_view bytes);

}  // namespace relief
