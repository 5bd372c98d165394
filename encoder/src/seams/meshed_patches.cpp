#include "seams/meshed_patches.h"

#include <memory>
#include <stdexcept>
#include <utility>

#include "mesh.h"
#include "restore.h"
#include "surface/largest_first.h"
#include "wavelet.h"

namespace relief {
namespace {

// As in the decoder's add_patch.
MeshedPatch mesh_alone(const CodedPatch& patch, float stream_spacing, float step,
                       const std::vector<int32_t>& q) {
  const uint32_t w = patch.header.width, h = patch.header.height;
  const Pyramid& p = patch.image->pyramid;
  const uint8_t* const mask = patch.image->mask.data();
  const auto scratch = std::make_unique_for_overwrite<float[]>(wavelet_scratch(w, h));
  const float* const z = inverse_wavelet(p, q.data(), mask, step, scratch.get());
  float* const restored = scratch.get() + wavelet_values(w, h);
  restore(p, mask, z, step, restored);

  size_t pixels = 0;
  for (size_t i = 0; i < size_t(w) * h; i++) pixels += patch.mask[i];
  MeshedPatch m;
  m.positions.resize(pixels);
  m.triangles.resize(2 * pixels);
  m.nodes.resize(count_boundary_nodes(patch.mask, w, h));
  m.loop_length.resize(m.nodes.size());
  MeshWriter writer = {
      m.positions[0].data(), m.triangles[0].data(), uint32_t(pixels), uint32_t(2 * pixels), 0, 0};
  Nodes nodes = {0, uint32_t(m.nodes.size()), 0, m.nodes.data(), m.loop_length.data()};
  const size_t size = size_t(w) * h;
  const auto numbers = std::make_unique_for_overwrite<uint32_t[]>(2 * size + h);
  const auto runs = std::make_unique_for_overwrite<Run[]>(size);
  const auto bytes = std::make_unique_for_overwrite<uint8_t[]>(cell_bytes(w, h) + size);
  const MeshScratch meshing = {reinterpret_cast<int32_t*>(numbers.get()),
                               numbers.get() + size,
                               runs.get(),
                               numbers.get() + 2 * size,
                               bytes.get(),
                               bytes.get() + cell_bytes(w, h)};
  const relief_status status =
      mesh_patch(patch.header, 0, spacing_of(stream_spacing, patch.header), p, 0, mask, restored, meshing,
                 writer, nodes, m.components, best_leaves());
  if (status != RELIEF_OK || nodes.count != m.nodes.size())
    throw std::logic_error("the decoder refuses a patch of the encoder's");
  m.triangles.resize(writer.triangle_count);
  m.loop_length.resize(nodes.loop_count);
  return m;
}

}  // namespace

std::vector<const MeshedPatch*> MeshedPatches::of(const std::vector<CodedPatch>& patches,
                                                  const StreamPlacement& placement, QuantisedImages& known) {
  std::map<const WaveletImage*, Entry> before = std::exchange(patches_, {});
  std::vector<const MeshedPatch*> all;
  std::vector<std::pair<size_t, Entry*>> fresh;
  for (size_t i = 0; i < patches.size(); i++) {
    const float step = step_of(placement, patches[i].header);
    const auto old = before.find(patches[i].image);
    Entry& entry = patches_[patches[i].image];
    if (old != before.end() && old->second.step == step)
      entry = std::move(old->second);
    else
      entry.step = step, fresh.push_back({i, &entry});
    all.push_back(&entry.mesh);
  }
  const auto size = [&](size_t k) { return patches[fresh[k].first].image->pyramid.size; };
  largest_first(fresh.size(), size, [&](size_t k) {
    const auto& [i, entry] = fresh[k];
    entry->mesh =
        mesh_alone(patches[i], placement.spacing, entry->step, known.of(patches[i].image, entry->step));
  });
  return all;
}

}  // namespace relief
