// The stages of a decode, for those who ask where the time goes: bench/decode_stages compiles the decoder
// with RELIEF_STAGES and is called at the end of each. Elsewhere nothing is left of it.
#pragma once

namespace relief {

enum class Stage { kTable, kMasks, kCoefficients, kWavelet, kMesh, kGaps, kNormals, kPlacement, kStages };

#ifdef RELIEF_STAGES
void stage_done(Stage stage);
#else
inline void stage_done(Stage) {}
#endif

}  // namespace relief
