// Binary range decoder (G. N. N. Martin 1979, in the carry form of Schindler and Pavlov's LZMA).
#pragma once
#include <stddef.h>
#include <stdint.h>

#include "models.h"

namespace relief {

class RangeDecoder {
 public:
  static constexpr bool kEncoding = false;

  // cut: these are not all bytes that the encoder wrote
  RangeDecoder(const uint8_t* data, size_t size, bool cut) : next_(data), end_(data + size), cut_(cut) {
    for (int i = 0; i < 4; i++) code_ = code_ << 8 | read();
  }

  // What a decoder needs to go on later, perhaps with more bytes. at: bytes read; 0: none yet.
  struct State {
    size_t at;
    uint32_t range, code;
  };
  RangeDecoder(const uint8_t* data, size_t size, bool cut, const State& s) : RangeDecoder(data, size, cut) {
    if (s.at == 0) return;
    next_ = data + s.at;
    range_ = s.range, code_ = s.code;
    missing_ = false;
  }
  State state(const uint8_t* data) const { return {size_t(next_ - data), range_, code_}; }

  // The next bit, whose probability of being 1 is p16 / 65536. The argument `bit` is there for the encoder's
  // twin.
  RELIEF_INLINE int code(int /*bit*/, uint32_t p16) {
    const uint32_t bound = (range_ >> 16) * p16;
    int bit;
    if (code_ < bound) {
      range_ = bound;
      bit = 1;
    } else {
      code_ -= bound;
      range_ -= bound;
      bit = 0;
    }
    while (range_ < 1u << 24) {
      range_ <<= 8;
      code_ = code_ << 8 | read();
    }
    return bit;
  }

  // True once the decoder has looked beyond the bytes of a cut stream: bits from here on are meaningless.
  // Beyond the bytes of a whole one there are zeros, which the encoder leaves out.
  bool exhausted() const { return cut_ && missing_; }

  // Bytes that are not read yet.
  size_t left() const { return size_t(end_ - next_); }

 private:
  RELIEF_INLINE uint32_t read() {
    if (next_ < end_) return *next_++;
    missing_ = true;
    return 0;
  }
  const uint8_t *next_, *end_;
  uint32_t range_ = 0xffffffffu, code_ = 0;
  bool cut_, missing_ = false;
};

}  // namespace relief
