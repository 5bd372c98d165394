// Trellis-coded quantisation of wavelet coefficients by rate and distortion (see next_state).
#pragma once
#include "code/forward_wavelet.h"
#include "coefficients.h"

namespace relief {

// The trellis at this share of a scalar quantiser's step errs as much as that does, for 4% fewer bits: the
// same lambda suits both.
constexpr float kTrellisStep = 0.6f;
constexpr float trellis_trade(double scalar_trade) {
  return float(scalar_trade / (kTrellisStep * kTrellisStep));
}

// Of all values of a band those that have the least (error / band's step)^2 + trade * bits, found by
// Viterbi's algorithm. models: much as the coder's are before the band; they learn what is taken. q: the
// image's planes, of which this band is written. Returns the squared error that reaches the surface, see
// estimate_band.
double quantise_by_trellis(CoefficientModels& models, const WaveletImage& image, int level, int type,
                           float step, float trade, int32_t* q);

}  // namespace relief
