// The coders' side of the range coder in decoder/src/range_decoder.h, and one that only counts bits.
#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

namespace relief {

class RangeEncoder {
 public:
  static constexpr bool kEncoding = true;

  int code(int bit, uint32_t p16) {
    const uint32_t bound = (range_ >> 16) * p16;
    if (bit) {
      range_ = bound;
    } else {
      low_ += bound;
      range_ -= bound;
    }
    while (range_ < 1u << 24) {
      range_ <<= 8;
      shift();
    }
    return bit;
  }

  // Bytes written so far, about: what is in the coder's registers is not counted.
  size_t size() const { return bytes_.size() + pending_; }

  // The bytes. Of all numbers in the last interval the one with the most trailing zeros is taken; zeros at
  // the end are left out, since the decoder makes them up.
  std::vector<uint8_t> finish() {
    for (int zeros = 32; zeros >= 0; zeros--) {
      const uint64_t mask = (uint64_t(1) << zeros) - 1;
      const uint64_t value = (low_ + mask) & ~mask;
      if (value - low_ < range_) {
        low_ = value;
        break;
      }
    }
    for (int i = 0; i < 5; i++) shift();
    while (!bytes_.empty() && bytes_.back() == 0) bytes_.pop_back();
    return std::move(bytes_);
  }

 private:
  void shift() {
    if (low_ < 0xff000000u || low_ >> 32) {
      const uint8_t carry = uint8_t(low_ >> 32);
      if (started_) bytes_.push_back(uint8_t(cache_ + carry));
      for (; pending_ > 0; pending_--) bytes_.push_back(uint8_t(0xff + carry));
      started_ = true;
      cache_ = uint8_t(low_ >> 24);
    } else {
      pending_++;
    }
    low_ = (low_ & 0x00ffffff) << 8;
  }
  std::vector<uint8_t> bytes_;
  uint64_t low_ = 0;
  uint32_t range_ = 0xffffffffu;
  size_t pending_ = 0;
  uint8_t cache_ = 0;
  bool started_ = false;
};

// Bits that a decision costs: -log2 of its probability.
inline float bit_cost(int bit, uint32_t p16) {
  static const std::vector<float> table = [] {
    std::vector<float> t(4097);
    for (int i = 0; i <= 4096; i++) t[size_t(i)] = -std::log2(std::max(i, 1) / 4096.0f);
    return t;
  }();
  const uint32_t p = bit ? p16 : 65536 - p16;
  return table[(p + 8) >> 4];
}

class CountingCoder {
 public:
  static constexpr bool kEncoding = true;
  int code(int bit, uint32_t p16) {
    bits_ += bit_cost(bit, p16);
    return bit;
  }
  double bits() const { return bits_; }

 private:
  double bits_ = 0;
};

}  // namespace relief
