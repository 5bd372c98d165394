// Sampling, coding and decoding the patches of a job once.
#pragma once
#include <list>

#include "encode/job.h"
#include "seams/seams.h"

namespace relief {

// The patches sampled as a Lagrangian parameter wants them, ready to be coded with any step.
struct Sampled {
  std::vector<CodedPatch> patches;
  std::vector<int> patch_number;
  StreamPlacement placement;
  std::list<CleanedPatch> cleaned;  // of patches whose masks were mended
  QuantisedImages quantised;        // with the last step
  bool mended = false;              // of more than strays
  bool finished = true;             // mending would not find much more
  Known known;                      // of seams, from trial to trial
};

// One stream and what it decodes to.
struct Trial {
  double lambda = 0;
  std::vector<uint8_t> stream, unquantised;
  TriangleMesh mesh;      // what it decodes to
  double error = 0;       // of that, fraction of the diagonal; see measure and measure_roughly
  bool measured = false;  // else that is known about, with enough care; 0: not at all
  Topology topology;      // of that
  size_t coincident = 0;  // vertices of that at another one's place; known of last words
  std::vector<int> patch_number;
  size_t coefficient_bytes = 0;  // of the stream
  Sampled sampled;               // what it was made of, of trials of the search
};

// The finest step that these patches can be coded with: magnitudes stay below 2^20, and so does what LL
// differs from its prediction by.
double finest_step(const std::vector<CodedPatch>& patches);

// density: spacings of all patches over their vertices'; 0: as the options say, or as lambda wants them.
Sampled sample(const Job& m, double lambda, Stopwatch& watch, double density = 0);

// See mend_masks.
void mend(const Job& m, Sampled& s, const MendRounds& most, Stopwatch& watch);

// Its error is not measured.
Trial code(const Job& m, Sampled& s, Care care, Stopwatch& watch);

void measure(const Job& m, Trial& trial, Stopwatch& watch);

// From the original to the trial only, and by few samples. The other way, masks that are yet to be mended may
// err a lot in few places.
double measure_roughly(const Job& m, const Trial& trial, Stopwatch& watch);

// Whether it has the pieces and the boundary loops of the surface, and no two vertices at one place: those
// are one to many programs, and the result no manifold.
bool is_sound(const Job& m, const Trial& trial);

// Of two trials within the target: whether a has fewer bytes than b, or less error where bytes are the target
// (0: they are not).
bool is_better(const Trial& a, const Trial& b, double bytes);

// How a trial stands to the target: 0 on it, positive beyond it (error too large, too many bytes), in the
// logarithm. Another set of samples may measure the error a little larger: it counts with a margin. bytes:
// the target; 0: it is one of error.
double excess(const Trial& t, const EncodeOptions& o, double bytes);

}  // namespace relief
