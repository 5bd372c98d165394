#include "partition/patches.h"

#include <algorithm>
#include <tuple>

namespace relief {

FaceLists faces_by_patch(const std::vector<int>& label, size_t patches) {
  FaceLists lists;
  lists.first.assign(patches + 1, 0);
  for (int l : label)
    if (l >= 0) ++lists.first[l + 1];
  for (size_t p = 0; p < patches; ++p) lists.first[p + 1] += lists.first[p];
  lists.face.resize(lists.first[patches]);
  std::vector<int> next(lists.first.begin(), lists.first.end() - 1);
  for (size_t f = 0; f < label.size(); ++f)
    if (label[f] >= 0) lists.face[next[label[f]]++] = static_cast<int>(f);
  return lists;
}

double edge_length(const Surface& surface, int face, int k) {
  const auto& v = surface.faces[face];
  return (surface.vertices[v[k]] - surface.vertices[v[(k + 1) % 3]]).norm();
}

std::vector<Border> borders(const Surface& surface, const std::vector<int>& label) {
  std::vector<Border> all;
  for (size_t f = 0; f < label.size(); ++f)
    for (int k = 0; k < 3; ++k) {
      const int g = surface.adjacent[f][k];
      if (g >= 0 && label[f] >= 0 && label[g] > label[f])
        all.push_back({label[f], label[g], edge_length(surface, static_cast<int>(f), k)});
    }
  std::stable_sort(all.begin(), all.end(),
                   [](const Border& x, const Border& y) { return std::tie(x.a, x.b) < std::tie(y.a, y.b); });
  size_t n = 0;
  for (const Border& e : all) {
    if (n > 0 && all[n - 1].a == e.a && all[n - 1].b == e.b)
      all[n - 1].length += e.length;
    else
      all[n++] = e;
  }
  all.resize(n);
  return all;
}

double boundary_length(const Surface& surface, const std::vector<int>& label) {
  double sum = 0;
  for (size_t f = 0; f < label.size(); ++f)
    for (int k = 0; k < 3; ++k) {
      const int g = surface.adjacent[f][k];
      if (g > static_cast<int>(f) && label[g] != label[f])
        sum += edge_length(surface, static_cast<int>(f), k);
    }
  return sum;
}

void refit(const Surface& surface, Patches& patches) {
  std::vector<Vec3> sum(patches.normal.size(), Vec3::Zero());
  std::vector<double> area(patches.normal.size(), 0);
  for (size_t f = 0; f < patches.label.size(); ++f) {
    const int p = patches.label[f];
    if (p < 0) continue;
    sum[p] += surface.normals[f] * surface.areas[f];
    area[p] += surface.areas[f];
  }
  for (size_t p = 0; p < sum.size(); ++p)
    if (sum[p].norm() > 1e-6 * area[p]) patches.normal[p] = sum[p].normalized();
}

void compact(Patches& patches) {
  std::vector<int> number(patches.normal.size(), -1);
  for (int l : patches.label)
    if (l >= 0) number[l] = 0;
  int n = 0;
  for (size_t p = 0; p < number.size(); ++p)
    if (number[p] == 0) {
      patches.normal[n] = patches.normal[p];
      number[p] = n++;
    }
  patches.normal.resize(n);
  for (int& l : patches.label)
    if (l >= 0) l = number[l];
}

}  // namespace relief
