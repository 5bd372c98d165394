/* relief.h compiles alone as C99. */
#include "relief/relief.h"

relief_status relief_header_is_c(const void* data, size_t size) {
  relief_info info;
  return relief_inspect(data, size, &relief_default_limits, &info);
}
