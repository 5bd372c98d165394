// The one place where tinygltf's implementation is compiled. Images are not decoded, so stb is not needed.
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#include <fstream>  // tinygltf forgets it under TINYGLTF_NO_FS
#define TINYGLTF_IMPLEMENTATION
#include "gltf/tinygltf_config.h"
