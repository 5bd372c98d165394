// relief.h compiles alone as C++11.
#include "relief/relief.h"

relief_status relief_header_is_cpp(const void* data, size_t size) {
  relief_info info;
  return relief_inspect(data, size, nullptr, &info);
}
