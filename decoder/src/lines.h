// Inverse lifting along all lines of a plane at once: its columns, or its rows.
//
// Whole rows of a plane are lifted as if all samples were inside of the mask and had their neighbours: a loop
// without branches. What lacks a neighbour, at the ends of segments, is listed before and done again. Values
// outside of the mask mean nothing.
#pragma once
#include "leaves.h"

namespace relief {

// Rows of samples, of which those of the even and of the odd places along the lines. Along its line the
// sample at even[i] is followed by odd[i], and that by even[i + apart]. An odd one without neighbours has its
// coefficient in the even place before it.
struct Lines {
  float *even, *odd;      // the first row of each
  uint32_t rows, length;  // rows of both; samples of each row
  ptrdiff_t apart;        // also from a row to the next of the same parity
};

// Samples without a neighbour before or after them: 8 times the number from `even` or `odd` on, and how it
// lacks it.
constexpr uint32_t kReaches = 1;  // there are three samples the other way
constexpr uint32_t kLast = 2;     // nothing follows; else nothing comes before
constexpr uint32_t kAlone = 4;    // neither

// Lists of them in one array: of even samples from its begin on, of odd ones from its end down.
struct EndLists {
  uint32_t *even, *odd;

  // The masks of up to 64 samples side by side and of those one, two and three samples before and after them.
  struct Masks {
    uint64_t before3, before2, before, here, after, after2, after3;
  };
  // Adds those of them that are ends. Bit i is sample number first + i / 2^shift of its parity.
  void add(const Masks& m, uint32_t first, int shift, uint64_t are_even);
};

// begin, end: the empty lists and those with all ends. kept: room for a value of each end
void inverse_lines(const Leaves& leaves, const Lines& lines, const EndLists& begin, const EndLists& end,
                   float* kept);

}  // namespace relief
