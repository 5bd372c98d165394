#include "seams/mask_edits.h"

#include <algorithm>

#include "resample/clean_mask.h"

namespace relief {

MaskEdits::MaskEdits(const std::vector<CodedPatch>& whole, std::list<CleanedPatch>& storage)
    : whole_(whole), storage_(storage), edited_(whole), gone_(whole.size(), 0), patches_(whole) {
  for (uint32_t p = 0; p < whole.size(); p++) origin_.push_back(p), number_.push_back(int(p));
}

void MaskEdits::take_out(const Pixel& pixel) {
  if (out_.insert({pixel.patch, pixel.index}).second) changed_.insert(pixel.patch);
}

void MaskEdits::put_back(const Pixel& pixel) {
  held_.insert({pixel.patch, pixel.index});
  if (out_.erase({pixel.patch, pixel.index})) changed_.insert(pixel.patch);
}

bool MaskEdits::clean(uint32_t p) {
  CodedPatch& patch = edited_[p] = whole_[p];
  const auto begin = out_.lower_bound({p, 0}), end = out_.lower_bound({p + 1, 0});
  if (begin == end) return true;
  ElevationMap map;
  map.width = patch.header.width, map.height = patch.header.height;
  map.mask.assign(patch.mask, patch.mask + size_t(map.width) * map.height);
  for (auto pixel = begin; pixel != end; ++pixel) map.mask[pixel->second] = 0;
  drop_unmeshable(map);
  if (!map.pixels) return false;
  storage_.push_back({std::move(map.mask), {}});
  storage_.back().image = forward_wavelet(map.width, map.height, storage_.back().mask.data(), patch.z);
  patch.mask = storage_.back().mask.data();
  patch.image = &storage_.back().image;
  return true;
}

bool MaskEdits::apply() {
  if (changed_.empty()) return false;
  for (uint32_t p : changed_) gone_[p] = !clean(p);
  changed_.clear();
  if (std::count(gone_.begin(), gone_.end(), 0) == 0) return false;
  patches_.clear(), origin_.clear();
  for (uint32_t p = 0; p < whole_.size(); p++) {
    number_[p] = gone_[p] ? -1 : int(patches_.size());
    if (!gone_[p]) patches_.push_back(edited_[p]), origin_.push_back(p);
  }
  return true;
}

}  // namespace relief
