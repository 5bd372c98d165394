// Quantisation of wavelet coefficients by rate and distortion, hand in hand with the coefficient coder.
#pragma once
#include "code/forward_wavelet.h"
#include "code/range_encoder.h"
#include "coefficients.h"

namespace relief {

// Rounds the coarsest LL to multiples of the step (it is coded by prediction; no choice is made there).
void quantise_low(const WaveletImage& image, float step, int32_t* q);

// What a bit costs, as the models are.
float bits_of(const Logistic& logistic, const Context& c, const BitModels& b, int bit);
constexpr float kSignBits = 1;  // about
float tail_bits(int32_t k);     // of a magnitude of kUnary or more, behind the unary part; about

// What coding a band takes and how it errs, at a fraction of the trellis's time: by a scalar quantiser of the
// step. For each coefficient the value among {nearest, one less, zero} is taken that has the least (error /
// band's step)^2 + trade * bits, with the bits that the models say at that moment (RDOQ). q receives the
// values in halves of steps, as the contexts want them. Returns the squared error that reaches the surface:
// linear interpolation between pixels passes (2 + cos w) / 3 of the energy at frequency w along each axis,
// that is 0.40 of HL1 and LH1, 0.21 of HH1, 0.77 and 0.63 of level 2. The steps of the bands are the square
// roots of the inverse, so an error in units of its band's step counts alike everywhere.
double estimate_band(CountingCoder& coder, CoefficientModels& models, const WaveletImage& image, int level,
                     int type, float step, float trade, int32_t* q);

}  // namespace relief
