// What patches decode to, each alone: kept while other patches change.
#pragma once
#include <map>

#include "code/stream.h"
#include "nodes.h"

namespace relief {

// Vertices, nodes, loops and components are numbered from the patch's first.
struct MeshedPatch {
  std::vector<std::array<float, 3>> positions;  // lattice
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<Node> nodes;
  std::vector<uint32_t> loop_length;
  uint32_t components = 0;
};

class MeshedPatches {
 public:
  // Meshes those that were not there before with the same image and step, side by side, and forgets what is
  // not there any more. known: the images, quantised.
  std::vector<const MeshedPatch*> of(const std::vector<CodedPatch>& patches, const StreamPlacement& placement,
                                     QuantisedImages& known);

  // Forgets images that are no more.
  void keep(const std::set<const WaveletImage*>& images) {
    std::erase_if(patches_, [&](const auto& entry) { return images.count(entry.first) == 0; });
  }

 private:
  struct Entry {
    float step;
    MeshedPatch mesh;
  };
  std::map<const WaveletImage*, Entry> patches_;
};

}  // namespace relief
