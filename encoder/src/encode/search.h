// Rate control: the Lagrangian parameter for a target of error or of bytes (3.6).
#pragma once
#include "encode/trial.h"

namespace relief {

// bytes: the target; 0: the options' error. met: whether the result keeps within it.
Trial search(Job& m, double bytes, bool& met, Stopwatch& watch);

}  // namespace relief
