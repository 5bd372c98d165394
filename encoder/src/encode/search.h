// Rate control: the Lagrangian parameter for a target of error or of bytes (3.6).
#pragma once
#include <memory>

#include "encode/trial.h"

namespace relief {

// What a search has found: a trial near the target, whose last word is yet to be said, and the patches it is
// of.
struct Found {
  Trial trial;
  bool met = false;  // whether the trial keeps within the target
  double cost = 0;   // logarithm of what it would take at another error; less is better
  std::unique_ptr<Patching> patching;
};

// The search with the job's patches, which it takes away. bytes: the target; 0: the options' error. lambda:
// where to begin; 0: where targets usually lie. rival: the cost of other patches; if the first trial tells
// that these will not do better, it is the only one.
Found search(Job& m, double bytes, double lambda, double rival, Stopwatch& watch);

}  // namespace relief
