// The types and ranges in a glTF file that our code relies on.
#pragma once
#include "gltf/document.h"

namespace relief {

// Throws InputError unless every property that we read has the type that glTF 2.0 gives it, and every index
// of an accessor, buffer view, buffer, mesh or node is in range. Properties that we only pass through are not
// looked at.
void check_json(Json& root);

}  // namespace relief
