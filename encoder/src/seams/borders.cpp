#include "seams/borders.h"

namespace relief {

void Borders::add(const DecodedMesh& decoded, size_t begin, size_t end, std::vector<Sums>& sums) {
  for (size_t t = begin; t < end; t++) {
    const auto& c = decoded.mesh.triangles[t];
    for (size_t k = 0; k < 3; k++) {
      const int64_t a = c[(k + 1) % 3], b = c[(k + 2) % 3];
      sums[c[k]].first += b - a;
      sums[c[k]].second += b * b - a * a;
    }
  }
}

Borders::Borders(const DecodedMesh& decoded) : patches_(decoded.mesh.positions.size()) {
  add(decoded, 0, decoded.patch_triangles(), patches_);
}

Borders::Count Borders::count(const DecodedMesh& decoded) const {
  std::vector<Sums> sums = patches_;
  sums.resize(decoded.mesh.positions.size());
  add(decoded, decoded.patch_triangles(), decoded.mesh.triangles.size(), sums);
  Count count;
  std::vector<char> seen(sums.size(), 0);
  for (size_t start = 0; start < sums.size(); start++) {
    if (sums[start].first == 0 || seen[start]) continue;
    count.loops++;
    for (size_t v = start; !seen[v]; count.edges++) {
      seen[v] = 1;
      // from the difference of both ends of the chain and their sum, its start: there the border goes on
      v = size_t((sums[v].second / sums[v].first - sums[v].first) / 2);
    }
  }
  return count;
}

}  // namespace relief
