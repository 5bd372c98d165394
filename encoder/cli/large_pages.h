// Large pages for the program's memory.
#pragma once

namespace relief::cli {

// To be called first, with the arguments of main. Encoding looks here and there into hundreds of megabytes,
// and takes and frees the same ones over and over: with pages of 2 MB, and without giving memory back in
// between, Dragon takes an eighth less time. glibc is told so by its environment alone, so the program starts
// again with that; unless GLIBC_TUNABLES is set already. Elsewhere nothing happens.
void prefer_large_pages(char** arguments);

}  // namespace relief::cli
