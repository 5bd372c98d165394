// Pixels taken out of the masks of patches, and put back.
#pragma once
#include <list>
#include <set>

#include "seams/decoded.h"

namespace relief {

// A patch's mask and image without some pixels.
struct CleanedPatch {
  std::vector<uint8_t> mask;
  WaveletImage image;
};

class MaskEdits {
 public:
  // storage: keeps what patches() points to
  MaskEdits(const std::vector<CodedPatch>& whole, std::list<CleanedPatch>& storage);

  // The patches as they were.
  const std::vector<CodedPatch>& whole() const { return whole_; }
  // Patches that lose every pixel are not there.
  const std::vector<CodedPatch>& patches() const { return patches_; }
  // Of each patch as it was: its number in patches(), or -1.
  const std::vector<int>& number() const { return number_; }
  // A pixel of patches() as one of the patches as they were.
  Pixel whole_pixel(const Pixel& now) const { return {origin_[now.patch], now.index}; }

  // Of pixels of the patches as they were. One that was put back is held until release(): callers leave it
  // alone.
  void take_out(const Pixel& pixel);
  void put_back(const Pixel& pixel);
  void release() { held_.clear(); }
  bool is_held(const Pixel& pixel) const { return held_.count({pixel.patch, pixel.index}) > 0; }

  // Renews patches(). False if nothing has changed, or nothing would be left.
  bool apply();

 private:
  using Key = std::pair<uint32_t, uint32_t>;
  bool clean(uint32_t p);  // false: no pixel is left

  const std::vector<CodedPatch> whole_;
  std::list<CleanedPatch>& storage_;
  std::set<Key> out_, held_;
  std::set<uint32_t> changed_;
  std::vector<CodedPatch> edited_;  // for each of whole_
  std::vector<char> gone_;
  std::vector<CodedPatch> patches_;
  std::vector<uint32_t> origin_;  // of patches_
  std::vector<int> number_;
};

}  // namespace relief
