#include "large_pages.h"

#include <cstdlib>

#ifdef __GLIBC__
#include <unistd.h>
#endif

namespace relief::cli {

void prefer_large_pages([[maybe_unused]] char** arguments) {
#ifdef __GLIBC__
  constexpr const char* kName = "GLIBC_TUNABLES";
  if (std::getenv(kName)) return;
  // blocks of up to 32 MB, glibc's limit, lie in heaps, which grow by 64 MB and do not shrink
  setenv(kName,
         "glibc.malloc.hugetlb=1:glibc.malloc.mmap_threshold=33554432:glibc.malloc.top_pad=67108864:"
         "glibc.malloc.trim_threshold=4294967296",
         1);
  execv("/proc/self/exe", arguments);
  unsetenv(kName);  // it goes on as it is
#endif
}

}  // namespace relief::cli
