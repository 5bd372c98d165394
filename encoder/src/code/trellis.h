// Trellis-coded quantisation of wavelet coefficients by rate and distortion (see next_state).
#pragma once
#include <memory>

#include "code/forward_wavelet.h"
#include "coefficients.h"

namespace relief {

// The trellis at this share of a scalar quantiser's step errs as much as that does, for 4% fewer bits: the
// same lambda suits both.
constexpr float kTrellisStep = 0.6f;
constexpr float trellis_trade(double scalar_trade) {
  return float(scalar_trade / (kTrellisStep * kTrellisStep));
}

// Decides on the bands of a stream in the order in which they are coded; its models follow the coder's.
class Trellis {
 public:
  Trellis();

  // Of all values of a band those that have the least (error / band's step)^2 + trade * bits, found by
  // Viterbi's algorithm. q: the image's planes, of which this band is written. Returns the squared error that
  // reaches the surface, see estimate_band.
  double quantise(const WaveletImage& image, int level, int type, float step, float trade, int32_t* q);

 private:
  std::unique_ptr<CoefficientModels> models_;
};

}  // namespace relief
