#include "seams.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "decode.h"

namespace relief {
namespace {

// A face between patches is a hole of the surface where its triangles' middles leave it by so many grid
// spacings, and may be one from the second figure on.
constexpr float kHole = 1.0f, kMaybeHole = 0.2f;
// Right links run along the surface. One whose points leave it by more than this share of its length may be
// wrong ...
constexpr float kSuspicious = 0.3f;
// ... and by more than this is.
constexpr float kWrong = 0.6f;
constexpr int kMostTrials = 12;

// A link or a face with how far it leaves the surface.
struct Suspect {
  float distance;
  uint32_t number;
};

void worst_first(std::vector<Suspect>& s) {
  std::sort(s.begin(), s.end(), [](const Suspect& a, const Suspect& b) {
    return a.distance != b.distance ? a.distance > b.distance : a.number < b.number;
  });
}

Vec3 lattice(const Surface& s, const std::array<float, 3>& p) {
  return (Vec3(p[0], p[1], p[2]) - s.origin) / s.scale;
}

// Faces that may be holes, the emptiest first, with distances in grid spacings.
std::vector<Suspect> suspicious_faces(const DecodedMesh& d, const SeamsInput& in) {
  std::vector<Vec3> points;
  std::vector<uint32_t> face_of_point;
  const auto& triangles = d.mesh.triangles;
  for (uint32_t f = 0; f < d.first_triangle.size(); f++) {
    const size_t end = f + 1 < d.first_triangle.size() ? d.first_triangle[f + 1] : triangles.size();
    for (size_t t = d.first_triangle[f]; t < end; t++) {
      Vec3 middle = Vec3::Zero();
      for (uint32_t v : triangles[t]) middle += lattice(in.surface, d.mesh.positions[v]) / 3;
      points.push_back(middle);
      face_of_point.push_back(f);
    }
  }
  std::vector<Suspect> faces;
  if (points.empty()) return faces;
  const std::vector<float> distance = in.distance(points);
  for (size_t i = 0; i < points.size(); i++) {
    const float spacings = distance[i] / float(in.spacing);
    if (spacings < kMaybeHole) continue;
    if (faces.empty() || faces.back().number != face_of_point[i])
      faces.push_back({spacings, face_of_point[i]});
    else
      faces.back().distance = std::max(faces.back().distance, spacings);
  }
  worst_first(faces);
  return faces;
}

// Links whose points leave the surface, the worst first, with distances in lengths of the link.
std::vector<Suspect> suspicious_links(const DecodedMesh& d, const SeamsInput& in) {
  std::vector<Vec3> points;
  std::vector<float> length;
  for (const auto& link : d.links) {
    const Vec3 a = lattice(in.surface, d.mesh.positions[link[0]]),
               b = lattice(in.surface, d.mesh.positions[link[1]]);
    for (double t : {0.25, 0.5, 0.75}) points.push_back(a + t * (b - a));
    length.push_back(std::max(1.0f, float((b - a).norm())));
  }
  std::vector<Suspect> links;
  if (points.empty()) return links;
  const std::vector<float> distance = in.distance(points);
  for (uint32_t i = 0; i < d.links.size(); i++) {
    const float most = std::max({distance[3 * i], distance[3 * i + 1], distance[3 * i + 2]}) / length[i];
    if (most > kSuspicious) links.push_back({most, i});
  }
  worst_first(links);
  return links;
}

// How far a topology is from the surface's: pieces and loops count more than handles.
double mismatch(const Topology& is, const Topology& should) {
  auto difference = [](double a, double b) { return std::abs(a - b); };
  return 3 * difference(double(is.components), double(should.components)) +
         2 * difference(double(is.boundary_loops), double(should.boundary_loops)) +
         difference(double(is.genus), double(should.genus));
}

struct Attempt {
  Seams seams;
  DecodedMesh decoded;
  Topology topology;
  double mismatch = 0;
};

Attempt attempt(const StreamParts& parts, const SeamsInput& in, Seams seams) {
  Attempt a;
  std::sort(seams.dropped_links.begin(), seams.dropped_links.end());
  std::sort(seams.holes.begin(), seams.holes.end());
  a.decoded = decode_with_seams(assemble(parts, {parts.boundary_nodes, 0, 0}, seams));
  a.topology = topology(a.decoded.mesh);
  a.mismatch = mismatch(a.topology, in.topology);
  a.seams = std::move(seams);
  return a;
}

// With these links dropped, every face open that is clearly a hole.
Attempt with_holes(const StreamParts& parts, const SeamsInput& in, std::vector<uint32_t> dropped) {
  Attempt filled = attempt(parts, in, {std::move(dropped), {}});
  if (in.closed) return filled;
  Seams seams = filled.seams;
  for (const Suspect& face : suspicious_faces(filled.decoded, in))
    if (face.distance > kHole) seams.holes.push_back(face.number);
  return seams.holes.empty() ? filled : attempt(parts, in, std::move(seams));
}

// Opens or closes the faces that one cannot be sure of, as long as that brings the number of loops nearer.
void adjust_holes(const StreamParts& parts, const SeamsInput& in, Attempt& best) {
  const Attempt filled = attempt(parts, in, {best.seams.dropped_links, {}});
  const std::vector<Suspect> faces = suspicious_faces(filled.decoded, in);
  int trials = 0;
  for (size_t i = 0; i < faces.size() && trials < kMostTrials; i++) {
    if (best.topology.boundary_loops == in.topology.boundary_loops) return;
    Seams seams = best.seams;
    const auto at = std::find(seams.holes.begin(), seams.holes.end(), faces[i].number);
    if ((best.topology.boundary_loops > in.topology.boundary_loops) != (at != seams.holes.end())) continue;
    if (at == seams.holes.end())
      seams.holes.push_back(faces[i].number);
    else
      seams.holes.erase(at);
    Attempt a = attempt(parts, in, std::move(seams));
    trials++;
    if (a.mismatch < best.mismatch) best = std::move(a);
  }
}

void drop_wrong_links(const StreamParts& parts, const SeamsInput& in, Attempt& best) {
  const std::vector<Suspect> links = suspicious_links(best.decoded, in);
  auto try_dropping = [&](std::vector<uint32_t> dropped) {
    Attempt a = with_holes(parts, in, std::move(dropped));
    if (a.mismatch < best.mismatch) best = std::move(a);
  };
  std::vector<uint32_t> wrong;
  for (const Suspect& link : links)
    if (link.distance > kWrong) wrong.push_back(link.number);
  if (!wrong.empty()) try_dropping(wrong);
  for (size_t i = 0; i < links.size() && i < kMostTrials && best.mismatch > 0; i++) {
    std::vector<uint32_t> dropped = best.seams.dropped_links;
    if (std::find(dropped.begin(), dropped.end(), links[i].number) != dropped.end()) continue;
    dropped.push_back(links[i].number);
    try_dropping(std::move(dropped));
  }
}

}  // namespace

DecodedMesh decode_with_seams(const std::vector<uint8_t>& stream) {
  const relief_limits limits = {UINT32_MAX, UINT32_MAX, UINT32_MAX};
  relief_info info;
  relief_status status = relief_inspect(stream.data(), stream.size(), &limits, &info);
  DecodedMesh d;
  if (status == RELIEF_OK) {
    d.mesh.positions.resize(info.vertex_capacity);
    d.mesh.triangles.resize(info.triangle_capacity);
    d.first_triangle.resize(info.triangle_capacity);
    d.links.resize(info.vertex_capacity);
    struct alignas(16) Block {
      uint8_t bytes[16];
    };
    std::vector<Block> workspace(info.workspace_bytes / 16 + 1);
    GapTrace trace = {d.first_triangle.data(),
                      uint32_t(d.first_triangle.size()),
                      0,
                      reinterpret_cast<uint32_t(*)[2]>(d.links.data()),
                      uint32_t(d.links.size()),
                      0};
    relief_mesh out = {};
    out.positions = d.mesh.positions[0].data();
    out.indices = d.mesh.triangles[0].data();
    out.vertex_capacity = info.vertex_capacity;
    out.triangle_capacity = info.triangle_capacity;
    status = decode_traced(stream.data(), stream.size(), &limits, &out, workspace.data(),
                           workspace.size() * sizeof(Block), &trace);
    d.mesh.positions.resize(out.vertex_count);
    d.mesh.triangles.resize(out.triangle_count);
    d.first_triangle.resize(trace.count);
    d.links.resize(trace.link_count);
  }
  if (status != RELIEF_OK)
    throw std::logic_error(std::string("the decoder refuses the encoder's stream: ") +
                           relief_status_text(status));
  return d;
}

Seams find_seams(const StreamParts& parts, const SeamsInput& input, bool thorough, DecodedMesh& decoded) {
  Attempt best = with_holes(parts, input, {});
  if (thorough && best.mismatch > 0) drop_wrong_links(parts, input, best);
  if (thorough && !input.closed) adjust_holes(parts, input, best);
  decoded = std::move(best.decoded);
  return best.seams;
}

}  // namespace relief
