// Status texts and default limits.
#include "relief/relief.h"

extern "C" const char* relief_status_text(int status) {
  switch (status) {
    case RELIEF_OK:
      return "no error";
    case RELIEF_ERROR_ARGUMENT:
      return "a pointer is null, an option is out of range, or the workspace is not aligned to 16 bytes";
    case RELIEF_ERROR_TRUNCATED:
      return "the stream is too short to be decoded";
    case RELIEF_ERROR_MAGIC:
      return "not a Relief stream";
    case RELIEF_ERROR_VERSION:
      return "a stream version that this decoder does not know";
    case RELIEF_ERROR_CORRUPT:
      return "the stream contradicts itself";
    case RELIEF_ERROR_LIMIT:
      return "the stream asks for more than the limits allow";
    case RELIEF_ERROR_WORKSPACE:
      return "the workspace is too small";
    case RELIEF_ERROR_OUTPUT:
      return "the output is too small for the mesh";
  }
  return "unknown status";
}

extern "C" const relief_limits relief_default_limits = {1u << 20, 1u << 28, 1u << 27, 0};
