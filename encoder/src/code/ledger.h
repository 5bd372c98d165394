// Where the bytes of a stream go.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

namespace relief {

struct Ledger {
  static constexpr int kBands = 4;
  static constexpr const char* kBandNames[kBands] = {"LL", "HL", "LH", "HH"};
  // bytes; they add up to the stream
  uint64_t header = 0, side = 0, masks = 0, coefficients = 0, seams = 0, colours = 0;
  std::vector<uint64_t> by_level;  // bytes of the coefficients by wavelet level, the coarsest (with LL) first
  std::vector<std::array<uint64_t, kBands>>
      by_band;                     // the same by sub-band: LL (of the coarsest level), HL, LH, HH
  std::vector<uint64_t> by_plane;  // of bisk instead of these two: bytes by bit plane, the highest first
  struct P {
    uint32_t width = 0, height = 0, pixels = 0;  // of the rectangle; pixels inside the mask
    double spacing = 0;                          // of the grid, in the units of the model
    std::array<double, 3> normal{};              // of the plane
    uint64_t masks = 0, coefficients = 0;        // bytes; over all patches they add up to those of the stream
  };
  std::vector<P> patches;
};

// Throws InputError with the status' text if the stream is not whole or not valid.
Ledger read_ledger(const std::vector<uint8_t>& stream);

}  // namespace relief
