// Colours of the vertices of a finished stream: taken from the input, coded, put behind the surface.
#pragma once
#include "relief/encoder.h"

namespace relief {

struct ColourTarget {
  double error;  // rms over red, green and blue of all vertices of patches, levels of a byte
  size_t bytes;  // of the stream with its colours, which may take fewer; 0: the error is the target
};

struct CodedColours {
  double error = 0;  // what it came to, against the input's colours where vertices are
  bool met = false;
};

// input: a mesh or a cloud with colours, in the units of the stream's model.
CodedColours add_colours(const TriangleMesh& input, const ColourTarget& target, std::vector<uint8_t>& stream);

}  // namespace relief
