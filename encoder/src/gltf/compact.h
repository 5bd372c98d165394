// Leaves out what nothing refers to any more.
#pragma once
#include <set>

#include "gltf/document.h"

namespace relief {

// Call after the references to `released` accessors (and `released_views`, buffer views that were referred to
// directly) are gone from the JSON: removes those that are unreferenced, the buffer views that only they
// referred to, and the bytes, and renumbers everything that refers to what stays. All buffers with data
// become one, buffer 0.
void compact(Document& document, const std::set<size_t>& released, const std::set<size_t>& released_views);

}  // namespace relief
