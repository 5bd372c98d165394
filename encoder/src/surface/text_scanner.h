// Reads numbers and words from text in memory, fast, and knows the line to blame.
#pragma once
#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "relief/encoder.h"

namespace relief {

class TextScanner {
 public:
  explicit TextScanner(std::string_view text) : begin_(text.data()), p_(begin_), end_(begin_ + text.size()) {}

  bool at_end() const { return p_ == end_; }
  size_t remaining() const { return size_t(end_ - p_); }

  // Skips blanks within the line; true if something else follows on it.
  bool more_on_line() {
    while (p_ != end_ && (*p_ == ' ' || *p_ == '\t' || *p_ == '\r')) p_++;
    return p_ != end_ && *p_ != '\n';
  }

  // Skips blanks and line ends.
  void skip_space() {
    while (p_ != end_ && is_space(*p_)) p_++;
  }

  void skip_line() {
    p_ = std::find(p_, end_, '\n');
    if (p_ != end_) p_++;
  }

  // Skips blanks, line ends and comments from '#' to the end of the line.
  void skip_space_and_comments() {
    for (skip_space(); p_ != end_ && *p_ == '#'; skip_space()) skip_line();
  }

  // The next word after white space; empty at the end.
  std::string_view word() {
    skip_space();
    const char* first = p_;
    while (p_ != end_ && !is_space(*p_)) p_++;
    return {first, size_t(p_ - first)};
  }

  // The rest of the line without its end.
  std::string_view line() {
    const char* first = p_;
    skip_line();
    const char* last = p_;
    while (last != first && (last[-1] == '\n' || last[-1] == '\r')) last--;
    return {first, size_t(last - first)};
  }

  float number() {
    skip_space();
    skip_plus();
    float value = 0;
    auto [rest, error] = std::from_chars(p_, end_, value);
    if (error == std::errc::invalid_argument) fail_expected("a number");
    // Out of range is either an infinity, which the caller reports with the vertex, or a value next to zero.
    if (error == std::errc::result_out_of_range) value = std::strtof(std::string(p_, rest).c_str(), nullptr);
    p_ = rest;
    if (p_ != end_ && !is_space(*p_)) fail_expected("a number");
    return value;
  }

  // An integer that ends at white space, at the end or at one of `also`.
  int64_t integer(std::string_view also = {}) {
    skip_space();
    skip_plus();
    int64_t value = 0;
    auto [rest, error] = std::from_chars(p_, end_, value);
    if (error != std::errc()) fail_expected("an integer");
    if (rest != end_ && !is_space(*rest) && also.find(*rest) == std::string_view::npos)
      fail_expected("an integer");
    p_ = rest;
    return value;
  }

  // Takes the next character if it is `c`.
  bool accept(char c) {
    if (p_ == end_ || *p_ != c) return false;
    p_++;
    return true;
  }

  size_t line_number() const { return size_t(std::count(begin_, p_, '\n')) + 1; }

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError("line " + std::to_string(line_number()) + ": " + what);
  }

 private:
  static bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

  void skip_plus() {
    if (p_ != end_ && *p_ == '+') p_++;
  }

  [[noreturn]] void fail_expected(const char* what) const {
    if (p_ == end_) fail(std::string("the file ends where ") + what + " should be");
    const char* last = p_;
    while (last != end_ && !is_space(*last) && last - p_ < 20) last++;
    std::string found(p_, last);
    for (char& c : found)
      if (c < ' ' || c > '~') c = '?';
    fail(std::string("expected ") + what + ", found '" + found + "'");
  }

  const char *begin_, *p_, *end_;
};

}  // namespace relief
