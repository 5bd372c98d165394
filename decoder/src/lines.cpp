#include "lines.h"

#include "wavelet.h"

namespace relief {
namespace {

// Those of one parity.
struct Samples {
  float* values;
  uint32_t rows, length;
  ptrdiff_t apart, before, after;  // the latter: from a sample to its neighbours
  const uint32_t *ends, *behind;
};

// Samples that are alone from their coefficients. from: how far from one of them its coefficient is
void set_alone(const Samples& s, ptrdiff_t from) {
  for (const uint32_t* e = s.ends; e < s.behind; e++) {
    float* const v = s.values + (*e >> 3);
    if (*e & kAlone) *v = v[from] * kAloneScale;
  }
}

// One step. extend: linearly at the ends of segments, where they reach that far
void lift(const Leaves& leaves, const Samples& s, float factor, bool extend, float* kept) {
  float* keep = kept;
  for (const uint32_t* e = s.ends; e < s.behind; e++) *keep++ = s.values[*e >> 3];
  for (uint32_t r = 0; r < s.rows; r++) {
    float* const row = s.values + ptrdiff_t(r) * s.apart;
    leaves.lift(row, row + s.before, row + s.after, factor, s.length);
  }
  const ptrdiff_t farther = extend ? s.apart : 0;
  const ptrdiff_t way[4] = {s.after, s.after + farther, s.before,
                            s.before - farther};  // by kLast and kReaches
  for (const uint32_t* e = s.ends; e < s.behind; e++) {
    float* const v = s.values + (*e >> 3);
    const float x = v[way[*e & kLast]], beyond = x + (x - v[way[*e & (kLast | kReaches)]]), value = *kept++;
    *v = pick(-int32_t(*e / kAlone & 1), value, value + factor * (x + beyond));
  }
}

}  // namespace

void EndLists::add(const Masks& m, uint32_t first, int shift, uint64_t are_even) {
  const uint64_t alone = ~(m.before | m.after);
  const uint64_t reaches = (m.after & m.after2 & m.after3) | (m.before & m.before2 & m.before3);
  for (uint64_t left = m.here & ~(m.before & m.after); left; left &= left - 1) {
    const int i = __builtin_ctzll(left);
    const uint32_t kind = uint32_t((reaches >> i & 1) | (m.before >> i & 1) << 1 | (alone >> i & 1) << 2);
    const uint32_t is_even = are_even >> i & 1;
    *even = odd[-1] = (first + (uint32_t(i) >> shift)) << 3 | kind;
    even += is_even;
    odd -= is_even ^ 1;
  }
}

void inverse_lines(const Leaves& leaves, const Lines& l, const EndLists& begin, const EndLists& end,
                   float* kept) {
  const ptrdiff_t over = l.odd - l.even;
  const Samples even = {l.even, (l.rows + 1) / 2, l.length, l.apart, over - l.apart,
                        over,   begin.even,       end.even};
  const Samples odd = {l.odd, l.rows / 2, l.length, l.apart, -over, l.apart - over, end.odd, begin.odd};
  set_alone(even, 0);
  set_alone(odd, -over);
  lift(leaves, even, -kLift[3], false, kept);
  lift(leaves, odd, -kLift[2], true, kept);
  lift(leaves, even, -kLift[1], true, kept);
  lift(leaves, odd, -kLift[0], true, kept);
}

}  // namespace relief
