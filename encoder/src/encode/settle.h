// The last word on a stream: it keeps its promise by the step alone, or with another Lagrangian parameter.
#pragma once
#include "encode/trial.h"

namespace relief {

// Of the logarithm of error or bytes over that of lambda, as a rule.
constexpr double kUsualSlope = 0.31;

// Settles what the nearest trial of a search was made of. Where sampling alone errs too much, no step helps:
// then with another lambda. met: whether a trial of the search met the target; then whether this one does.
Trial last_word(const Job& m, Trial nearest, double bytes, bool& met, Stopwatch& watch);

}  // namespace relief
