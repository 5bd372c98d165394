// Runs a fuzz target without libFuzzer, for every compiler:
//   TARGET FILE...      on files: what was found, or a corpus
//   TARGET --runs N     on the seeds, which must be accepted, and on N mutations of them, the same every time
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>

#include "golden.h"
#include "target.h"

namespace relief {
namespace {

class Random {  // xorshift64* (Vigna 2016)
 public:
  uint32_t below(size_t n) {
    state_ ^= state_ >> 12, state_ ^= state_ << 25, state_ ^= state_ >> 27;
    return uint32_t((state_ * 0x2545F4914F6CDD1Dull >> 32) % n);
  }

 private:
  uint64_t state_ = 0x9E3779B97F4A7C15ull;
};

// Numbers at which readers go wrong, as text and, by their last bytes, in binary.
constexpr const char* kNumbers[] = {
    "0",    "-1",     "1",   "2147483647", "-2147483648", "4294967295", "4294967296", "9223372036854775807",
    "1e39", "-1e-46", "nan", "inf",        "0.5",         "65536"};
constexpr uint32_t kWords[] = {0,          1,       0x7fffffff, 0x80000000, 0xffffffff,
                               0xfffffffe, 0x10000, 0x7f800000, 0x7fc00000};

bool is_digit(char c) { return c >= '0' && c <= '9'; }

void change(std::string& s, const std::string& other, Random& random) {
  if (s.empty()) return;
  const size_t at = random.below(s.size()), length = 1 + random.below(std::min<size_t>(s.size() - at, 32));
  switch (random.below(8)) {
    case 0:
      s[at] = char(s[at] ^ 1 << random.below(8));
      break;
    case 1:
      s[at] = char(random.below(256));
      break;
    case 2:
      s.erase(at, length);
      break;
    case 3:
      s.insert(random.below(s.size()), s.substr(at, length));
      break;
    case 4:
      s.resize(at);
      break;
    case 5: {  // the tail of another seed
      s = s.substr(0, at) + other.substr(std::min<size_t>(random.below(other.size() + 1), other.size()));
      break;
    }
    case 6: {
      const uint32_t word = kWords[random.below(std::size(kWords))];
      for (size_t i = 0; i < 4 && at + i < s.size(); i++) s[at + i] = char(word >> (8 * i));
      break;
    }
    case 7: {  // the next number in the text becomes another
      size_t begin = at;
      while (begin < s.size() && !is_digit(s[begin])) begin++;
      size_t end = begin;
      while (end < s.size() && is_digit(s[end])) end++;
      if (begin < end) s.replace(begin, end - begin, kNumbers[random.below(std::size(kNumbers))]);
      break;
    }
  }
}

// A copy of exactly this size, so that a sanitizer sees reads behind it.
bool accepts_copy(const std::string& bytes) {
  const std::vector<uint8_t> copy(bytes.begin(), bytes.end());
  return accepts(copy.data(), copy.size());
}

int run_mutations(size_t runs) {
  const std::vector<std::string> all = seeds();
  for (size_t i = 0; i < all.size(); i++)
    if (!accepts_copy(all[i])) {
      std::fprintf(stderr, "seed %zu is not accepted\n", i);
      return 1;
    }
  Random random;
  size_t accepted = 0;
  for (size_t i = 0; i < runs; i++) {
    std::string s = all[random.below(all.size())];
    for (size_t n = 1 + random.below(4); n > 0; n--) change(s, all[random.below(all.size())], random);
    accepted += accepts_copy(s);
  }
  std::printf("%zu seeds, %zu mutations, %zu of them accepted\n", all.size(), runs, accepted);
  return 0;
}

}  // namespace
}  // namespace relief

int main(int argc, char** argv) {
  try {
    if (argc == 3 && !std::strcmp(argv[1], "--runs"))
      return relief::run_mutations(std::strtoul(argv[2], nullptr, 10));
    for (int i = 1; i < argc; i++) {
      const std::vector<uint8_t> bytes = relief::read_bytes(argv[i]);
      relief::accepts(bytes.data(), bytes.size());
    }
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
  return 0;
}
