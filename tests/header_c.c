/* relief.h compiles alone as C99. */
#include "relief/relief.h"

relief_status relief_header_is_c(const void* data, size_t size) {
  relief_info info;
  relief_options options = {&relief_default_limits, NULL, 0, RELIEF_POINTS | RELIEF_QUANTISED, 0, 0, 0};
  return relief_inspect(data, size, &options, &info);
}
