// The `bisk` coefficient coder (3.5): embedded bit planes by binary set splitting with k-d trees (Fowler,
// "Shape-Adaptive Coding Using Binary Set Splitting with K-D Trees", ICIP 2004). Shared with the encoder.
//
// A patch is coded plane by plane, from the highest bit of its largest magnitude down, each plane in two
// passes. The significance pass tests sets of coefficients whose magnitudes have no bit yet: whether one of
// them has its first bit in this plane. A set that has is split in two, down to single coefficients, of which
// the sign is coded. The refinement pass codes one more bit of each coefficient that has had its first in a
// plane above.
//
// Passes of all patches share the models and are interleaved in layers (3.6): in each layer every patch makes
// as many passes as the encoder pleases.
#pragma once
#include "coefficients.h"

namespace relief {

// --- constants that are part of the format ---
constexpr int kMostPlanes = 26;  // bits of a magnitude
constexpr int kMostLayers = 64;
constexpr int kBands = 1 + 3 * kLevels;  // LL, then HL, LH, HH from the coarsest level on
// Bytes that must be left before a step of the coder is begun: a step makes at most two decisions, and no
// decision takes more than two bytes. So a stream may end anywhere, and what was coded last is never half
// known.
constexpr size_t kStepBytes = 4, kPlanesBytes = 10;
constexpr int kPlaneBits = 5;

constexpr uint32_t kDepths = 2 * 14 + 1;  // a band has at most 2^14 columns and rows
constexpr uint32_t kNoSet = 0xffffffffu;

// A rectangle of a band that the mask touches on all four sides: one in a list, or a coefficient with a bit.
struct BiskSet {
  uint16_t x, y, width, height;
  uint32_t next;  // in its list
  uint8_t band, depth;
};

// Where the passes of a patch have come to.
struct BiskPatch {
  uint32_t list[kDepths];  // sets without a bit, by the number of splits; the small ones are tested first
  uint32_t significant;    // coefficients with a bit, the last found first
  uint32_t used;           // sets
  uint64_t first_set;      // of the patch
  int8_t plane;            // of the next pass; below 0: all is coded
  bool refining;           // the next pass is a refinement
  uint8_t before;          // passes in the layer before
};

// Where a pass has come to.
struct BiskCursor {
  uint32_t depth;   // list that is tested
  uint32_t before;  // the set in it before the next one, or kNoSet; in a refinement, the next coefficient
  uint32_t open[kDepths + 1], open_count;  // sets to split, or coefficients to find the sign of
};

constexpr int kSurroundings = 12;  // classes of what is around a coefficient, and a set
constexpr int kSetSurroundings = 4;
constexpr int kSizes = 12;  // classes of sets, by the logarithm of their area

struct BiskModels {
  Model planes[1 << kPlaneBits];
  Model more[3][3];                        // by passes made in this layer and in the one before
  Model set[3][kSizes][kSetSurroundings];  // by role: in a list, first and second half of a split
  Model single[3][2][kSurroundings];       // likewise, of HH and of the other bands
  Model sign[4][9];
  Model refined[kSurroundings + 1];  // the second bit by what is around; all further ones

  RELIEF_COLD void init() {
    Model* const all = reinterpret_cast<Model*>(this);
    for (size_t i = 0; i < sizeof *this / sizeof(Model); i++) all[i] = kModelInit;
  }
};

// What is coded of a patch. target: the encoder's coefficients; null in the decoder. q: what of them is
// known: the bits, and for those that are missing about the middle of what they can be.
struct BiskImage {
  const Pyramid& pyramid;
  const uint8_t* mask;
  int32_t* q;
  const int32_t* target;
};

// What is added to a magnitude of which `plane` bits are missing.
constexpr int32_t missing_bits(int plane) { return ((1 << plane) - 1) * 7 >> 4; }

inline const Band& band_of(const Pyramid& p, int number) {
  return number == 0 ? p.low[kLevels] : p.high[kLevels - 1 - (number - 1) / 3][(number - 1) % 3];
}

inline int type_of_band(int number) { return number == 0 ? 3 : (number - 1) % 3; }  // 3: LL

// Pixels of the mask in a rectangle.
[[gnu::noinline]] inline uint32_t pixels_in(const uint8_t* mask, const Band& b, uint32_t x, uint32_t y,
                                            uint32_t width, uint32_t height) {
  uint32_t sum = 0;
  for (const uint32_t end = y + height; y < end; y++)
    for (uint32_t i = 0; i < width; i++) sum += mask[b.at(x + i, y)];
  return sum;
}

// Makes the rectangle, which is not empty, as small as the mask allows.
[[gnu::noinline]] inline void shrink(const Band& b, const uint8_t* mask, BiskSet& s) {
  while (!pixels_in(mask, b, s.x, s.y, s.width, 1)) s.y++, s.height--;
  while (!pixels_in(mask, b, s.x, s.y + s.height - 1u, s.width, 1)) s.height--;
  while (!pixels_in(mask, b, s.x, s.y, 1, s.height)) s.x++, s.width--;
  while (!pixels_in(mask, b, s.x + s.width - 1u, s.y, 1, s.height)) s.width--;
}

// Halves a set along its longer side, x if both are the same: `s` becomes the first half, `t` the second.
inline void split(const Band& b, const uint8_t* mask, BiskSet& s, BiskSet& t) {
  s.depth++;
  t = s;
  if (s.width >= s.height) {
    s.width = uint16_t((s.width + 1) / 2);
    t.x = uint16_t(t.x + s.width), t.width = uint16_t(t.width - s.width);
  } else {
    s.height = uint16_t((s.height + 1) / 2);
    t.y = uint16_t(t.y + s.height), t.height = uint16_t(t.height - s.height);
  }
  shrink(b, mask, s);
  shrink(b, mask, t);
}

// At first every band is a set. Returns the number of coefficients, which is that of pixels: as many sets are
// made at most.
RELIEF_COLD inline uint32_t start_patch(const Pyramid& p, const uint8_t* mask, BiskSet* sets,
                                        BiskPatch& patch) {
  for (uint32_t& head : patch.list) head = kNoSet;
  patch.significant = kNoSet;
  patch.used = 0;
  patch.refining = false;
  patch.before = 0;
  uint32_t pixels = 0;
  for (int i = kBands; i-- > 0;) {
    const Band& b = band_of(p, i);
    const uint32_t of_band = pixels_in(mask, b, 0, 0, b.width, b.height);
    if (of_band == 0) continue;
    pixels += of_band;
    BiskSet& s = sets[patch.used];
    s = {0, 0, uint16_t(b.width), uint16_t(b.height), patch.list[0], uint8_t(i), 0};
    shrink(b, mask, s);
    patch.list[0] = patch.used++;
  }
  return pixels;
}

inline uint32_t area_class(const BiskSet& s) {
  const int l = 31 - __builtin_clz(uint32_t(s.width) * s.height);
  return uint32_t(l < kSizes ? l : kSizes - 1);
}

// The magnitude above a place of a band, in the same band a level coarser.
[[gnu::noinline]] inline uint32_t parent_magnitude(const BiskImage& image, int number, uint32_t x,
                                                   uint32_t y) {
  if (number <= 3) return 0;
  const Band& up = band_of(image.pyramid, number - 3);
  if (!up.width || !up.height) return 0;
  const uint32_t px = x / 2 < up.width ? x / 2 : up.width - 1, py = y / 2 < up.height ? y / 2 : up.height - 1;
  return uint32_t(magnitude(image.q[up.at(px, py)]));
}

// How large the coefficients around one are, in terms of the plane: a class.
[[gnu::noinline]] inline int surroundings(const BiskImage& image, const BiskSet& set, int plane) {
  const Band& b = band_of(image.pyramid, set.band);
  const ptrdiff_t s = b.stride;
  const int32_t* c = image.q + b.at(set.x, set.y);
  auto at = [&](ptrdiff_t i) { return uint32_t(magnitude(c[i])); };
  const uint32_t beside = at(-1) + at(1) + at(-s) + at(s),
                 aslant = at(-s - 1) + at(-s + 1) + at(s - 1) + at(s + 1);
  const int c_of =
      activity_class((2 * beside + aslant + parent_magnitude(image, set.band, set.x, set.y)) >> plane);
  return c_of < kSurroundings ? c_of : kSurroundings - 1;
}

// How large those beside the middles of a set's sides are, and the one above its own middle.
[[gnu::noinline]] inline int surroundings_of_set(const BiskImage& image, const BiskSet& s, int plane) {
  const Band& b = band_of(image.pyramid, s.band);
  const uint32_t x = s.x + s.width / 2u, y = s.y + s.height / 2u;
  auto at = [&](size_t i) { return uint32_t(magnitude(image.q[i])); };
  const uint32_t e = at(b.at(s.x, y) - 1) + at(b.at(s.x + s.width, y)) + at(b.at(x, s.y) - b.stride) +
                     at(b.at(x, s.y + s.height)) + parent_magnitude(image, s.band, x, y);
  const uint32_t planes = e >> plane;
  return planes < 2 ? int(planes) : planes < 4 ? 2 : kSetSurroundings - 1;
}

inline int sign_of(int32_t v) { return (v > 0) - (v < 0); }

// Whether a coefficient of an encoder's set has its first bit in the plane: none has one above.
inline int has_bit(const BiskImage& image, const BiskSet& s, int plane) {
  const Band& b = band_of(image.pyramid, s.band);
  for (uint32_t y = s.y; y < uint32_t(s.y) + s.height; y++)
    for (uint32_t x = s.x; x < uint32_t(s.x) + s.width; x++)
      if (magnitude(image.target[b.at(x, y)]) >> plane) return 1;
  return 0;
}

// One decision; a call, since the code is small where it matters.
template <class Coder>
[[gnu::noinline]] int code_decision(Coder& coder, Model& m, int bit) {
  return code_bit<kCoefficientLimit>(coder, m, bit);
}

// role: 0 for a set of a list, 1 and 2 for the halves of a set.
template <class Coder>
[[gnu::noinline]] int code_test(Coder& coder, BiskModels& models, const BiskImage& image, const BiskSet& s,
                                int plane, int role) {
  Model& m = s.width == 1 && s.height == 1
                 ? models.single[role][type_of_band(s.band) == 2][surroundings(image, s, plane)]
                 : models.set[role][area_class(s)][surroundings_of_set(image, s, plane)];
  return code_decision(coder, m, Coder::kEncoding ? has_bit(image, s, plane) : 0);
}

template <class Coder>
void code_sign(Coder& coder, BiskModels& models, const BiskImage& image, const BiskSet& s, int plane) {
  const Band& b = band_of(image.pyramid, s.band);
  int32_t* const c = image.q + b.at(s.x, s.y);
  auto of_two = [](int32_t v, int32_t w) {
    const int sum = sign_of(v) + sign_of(w);
    return sum < 0 ? -1 : sum > 0;
  };
  const int context = 3 * of_two(c[-ptrdiff_t(b.stride)], c[b.stride]) + of_two(c[-1], c[1]) + 4;
  const int bit = Coder::kEncoding ? image.target[b.at(s.x, s.y)] < 0 : 0;
  const bool negative = code_decision(coder, models.sign[type_of_band(s.band)][context], bit);
  const int32_t value = (1 << plane) + missing_bits(plane);
  *c = negative ? -value : value;
}

inline void start_pass(const BiskPatch& patch, BiskCursor& at) {
  at = BiskCursor();
  at.depth = kDepths - 1;
  at.before = patch.refining ? patch.significant : kNoSet;
}

// Opens the last of the sets that are known to have a bit: finds the sign of a coefficient, or splits a
// larger set and tests its halves. Where the first has no bit, the second must have one.
template <class Coder>
void open_set(Coder& coder, BiskModels& models, const BiskImage& image, BiskSet* sets, BiskPatch& patch,
              BiskCursor& at) {
  const uint32_t first = at.open[--at.open_count];
  BiskSet& s = sets[first];
  if (s.width == 1 && s.height == 1) {
    code_sign(coder, models, image, s, patch.plane);
    s.next = patch.significant;
    patch.significant = first;
    return;
  }
  const uint32_t second = patch.used++;
  BiskSet& t = sets[second];
  split(band_of(image.pyramid, s.band), image.mask, s, t);
  auto file = [&](uint32_t set, bool open) {
    if (open) {
      at.open[at.open_count++] = set;
    } else {
      uint32_t& head = patch.list[sets[set].depth];
      sets[set].next = head;
      head = set;
    }
  };
  const bool open_first = code_test(coder, models, image, s, patch.plane, 1);
  file(second, !open_first || code_test(coder, models, image, t, patch.plane, 2));
  file(first, open_first);
}

// One step of a significance pass; false at its end.
template <class Coder>
bool significance_step(Coder& coder, BiskModels& models, const BiskImage& image, BiskSet* sets,
                       BiskPatch& patch, BiskCursor& at) {
  if (at.open_count > 0) {
    open_set(coder, models, image, sets, patch, at);
    return true;
  }
  uint32_t* link = at.before == kNoSet ? &patch.list[at.depth] : &sets[at.before].next;
  while (*link == kNoSet) {
    if (at.depth == 0) return false;
    at.before = kNoSet;
    link = &patch.list[--at.depth];
  }
  const uint32_t set = *link;
  if (code_test(coder, models, image, sets[set], patch.plane, 0)) {
    *link = sets[set].next;
    at.open[at.open_count++] = set;
  } else {
    at.before = set;
  }
  return true;
}

// One step of a refinement pass; false at its end.
template <class Coder>
bool refinement_step(Coder& coder, BiskModels& models, const BiskImage& image, BiskSet* sets,
                     BiskPatch& patch, BiskCursor& at) {
  while (at.before != kNoSet) {
    const BiskSet& s = sets[at.before];
    at.before = s.next;
    const size_t i = band_of(image.pyramid, s.band).at(s.x, s.y);
    const int32_t known = magnitude(image.q[i]) >> (patch.plane + 1);
    if (known == 0) continue;  // found in this plane
    const int context = known == 1 ? surroundings(image, s, patch.plane) : kSurroundings;
    const int bit = Coder::kEncoding ? magnitude(image.target[i]) >> patch.plane & 1 : 0;
    const int32_t bits = known << 1 | code_decision(coder, models.refined[context], bit);
    const int32_t value = (bits << patch.plane) + missing_bits(patch.plane);
    image.q[i] = image.q[i] < 0 ? -value : value;
    return true;
  }
  return false;
}

inline void end_pass(BiskPatch& patch) {
  if (patch.refining) patch.plane--;
  patch.refining = !patch.refining;
}

// The number of bit planes of a patch.
template <class Coder>
int code_planes(Coder& coder, BiskModels& models, int planes) {
  int node = 1;
  for (int i = kPlaneBits - 1; i >= 0; i--)
    node = node * 2 + code_decision(coder, models.planes[node], planes >> i & 1);
  node -= 1 << kPlaneBits;
  return node < kMostPlanes ? node : kMostPlanes;
}

// Whether a patch makes another pass in this layer, after `made`.
template <class Coder>
int code_more(Coder& coder, BiskModels& models, const BiskPatch& patch, int made, int bit) {
  auto cut = [](int v) { return v < 2 ? v : 2; };
  return code_decision(coder, models.more[cut(made)][cut(patch.before)], bit);
}

}  // namespace relief
