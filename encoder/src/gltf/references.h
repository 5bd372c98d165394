// Every place in a glTF file that refers to an accessor, a buffer view or a buffer by index.
#pragma once
#include <functional>

#include "gltf/document.h"

namespace relief {

enum class Referred { kAccessor, kView, kBuffer };
enum class Role {
  kPlain,
  kPrimitive,
  kAccessorData
};  // a primitive's accessor; an accessor's own buffer view

struct Reference {
  Referred to;
  Role role;
  size_t owner;  // the accessor's index for kAccessorData
  Json* index;
};

// Visits them in the order of the file. Knows KHR_draco_mesh_compression, EXT_/KHR_meshopt_compression,
// EXT_mesh_gpu_instancing and RELIEF_patch_compression.
void for_each_reference(Json& root, const std::function<void(const Reference&)>& visit);

// The name of an extension (or "extras") that seems to refer to accessors, buffer views or buffers in a way
// that for_each_reference does not know; empty if there is none. Nothing may be renumbered then.
std::string unknown_referrer(const Json& root);

}  // namespace relief
