#include "specks.h"

#include <algorithm>
#include <numeric>

namespace relief {
namespace {

constexpr size_t kMostTriangles = 64;  // of a speck

// For every vertex whether it belongs to a speck.
std::vector<char> speck_vertices(const TriangleMesh& mesh, size_t wanted) {
  std::vector<uint32_t> parent(mesh.positions.size());
  std::iota(parent.begin(), parent.end(), 0u);
  auto find = [&](uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const auto& t : mesh.triangles) {
    parent[find(t[0])] = find(t[1]);
    parent[find(t[1])] = find(t[2]);
  }
  std::vector<size_t> triangles(mesh.positions.size(), 0);
  for (const auto& t : mesh.triangles) triangles[find(t[0])]++;
  std::vector<size_t> sizes;
  for (size_t n : triangles)
    if (n) sizes.push_back(n);
  std::sort(sizes.rbegin(), sizes.rend());
  std::vector<char> speck(mesh.positions.size(), 0);
  if (sizes.size() <= wanted) return speck;
  const size_t limit = std::min(kMostTriangles, sizes[wanted - 1]);
  for (uint32_t v = 0; v < speck.size(); v++) {
    const size_t n = triangles[find(v)];
    speck[v] = n > 0 && n < limit;
  }
  return speck;
}

}  // namespace

bool remove_specks(const DecodedMesh& decoded, size_t wanted, std::vector<CodedPatch>& patches,
                   std::vector<int>& patch_number, std::list<CleanedPatch>& storage) {
  if (wanted == 0) return false;
  const std::vector<char> speck = speck_vertices(decoded.mesh, wanted);
  bool changed = false;
  size_t vertex = 0;  // the decoder numbers the pixels of all masks in order
  std::vector<CodedPatch> kept;
  std::vector<int> number(patches.size(), -1);
  for (size_t p = 0; p < patches.size(); p++) {
    CodedPatch patch = patches[p];
    const uint32_t w = patch.header.width, h = patch.header.height;
    std::vector<uint8_t> mask(patch.mask, patch.mask + size_t(w) * h);
    size_t pixels = 0, removed = 0;
    for (uint8_t& m : mask) {
      if (!m) continue;
      if (speck[vertex++]) m = 0, removed++;
      else pixels++;
    }
    changed = changed || removed;
    if (removed && pixels) {
      storage.push_back({std::move(mask), {}});
      storage.back().image = forward_wavelet(w, h, storage.back().mask.data(), patch.z);
      patch.mask = storage.back().mask.data();
      patch.image = &storage.back().image;
    }
    if (!pixels) continue;
    number[p] = int(kept.size());
    kept.push_back(patch);
  }
  if (!changed || kept.empty()) return false;
  for (int& n : patch_number)
    if (n >= 0) n = number[size_t(n)];
  patches = std::move(kept);
  return true;
}

}  // namespace relief
