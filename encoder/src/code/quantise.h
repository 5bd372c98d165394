// Quantisation of wavelet coefficients by rate and distortion, hand in hand with the coefficient coder.
#pragma once
#include <vector>

#include "code/forward_wavelet.h"
#include "coefficients.h"

namespace relief {

// Rounds the coarsest LL to multiples of the step (it is coded by prediction; no choice is made there).
void quantise_low(const WaveletImage& image, float step, int32_t* q);

// Quantises and codes one band. For each coefficient the value among {nearest, one less, zero} is taken that has the
// least (error / step)^2 + trade * bits, with the bits that the models say at that moment (RDOQ). q receives the
// values. Coder: RangeEncoder or CountingCoder. Returns the squared error.
template <class Coder>
double quantise_band(Coder& coder, CoefficientModels& models, const WaveletImage& image, int level, int type,
                     float step, float trade, int32_t* q);

}  // namespace relief
