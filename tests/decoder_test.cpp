// The decoder alone, on golden streams and on what is left of them after damage.
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include "coarse_mask.h"
#include "coefficients.h"
#include "container.h"
#include "decode.h"
#include "decoded.h"
#include "golden.h"
#include "output.h"
#include "wavelet.h"

// Compiled as C99 and as C++11.
extern "C" relief_status relief_header_is_c(const void* data, size_t size);
relief_status relief_header_is_cpp(const void* data, size_t size);

namespace relief {
namespace {

const std::vector<Golden>& golden() {
  static const std::vector<Golden> all = read_golden(RELIEF_SOURCE_DIR "/tests/golden");
  return all;
}

const Golden& golden(const std::string& name) {
  for (const Golden& g : golden())
    if (g.name == name) return g;
  throw std::runtime_error("no golden stream " + name);
}

Decoded decode_bytes(const std::vector<uint8_t>& bytes, const relief_limits* limits = nullptr) {
  const relief_options options = options_of(limits);
  return decode_exactly(bytes.data(), bytes.size(), &options);
}

size_t components_of(const Decoded& d) {
  std::vector<uint32_t> parent(d.vertices());
  std::iota(parent.begin(), parent.end(), 0u);
  auto find = [&](uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (size_t t = 0; t < d.indices.size(); t += 3)
    for (size_t k = 0; k < 2; k++) parent[find(d.indices[t + k])] = find(d.indices[t + k + 1]);
  size_t n = 0;
  for (uint32_t i = 0; i < parent.size(); i++) n += parent[i] == i;
  return n;
}

// Limits that keep a damaged stream from asking for much.
constexpr relief_limits kSmall = {1 << 10, 1 << 16, 1 << 16, 0};

// No stream within the limits may ask for more memory than this: the planes of a pyramid take at most 8
// elements a pixel and 640 a patch (container.cpp), and a vertex can be a border node.
uint64_t workspace_bound(const relief_limits& l) {
  return (1 << 20) + 3400 * uint64_t(l.max_patches) + 96 * uint64_t(l.max_pixels) +
         512 * uint64_t(l.max_vertices);
}

// Decodes bytes of any kind and checks what every decoder must keep. Returns the status.
relief_status expect_error_or_good_mesh(const std::vector<uint8_t>& bytes, const std::string& what,
                                        bool closed = false) {
  const Decoded d = decode_bytes(bytes, &kSmall);
  EXPECT_LE(d.info.workspace_bytes, workspace_bound(kSmall)) << what;
  if (d.inspected == RELIEF_OK) {
    const uint32_t seed = uint32_t(std::hash<std::string>()(what));
    const Decoded other = decode_randomly(bytes.data(), bytes.size(), kSmall, seed);
    if (other.status == RELIEF_OK) {
      EXPECT_EQ(fault_of(other), "") << what << ", other options of " << seed;
    } else {
      EXPECT_EQ(other.status, other.status == RELIEF_ERROR_OUTPUT ? other.status : d.status) << what;
    }
  }
  if (d.status == RELIEF_OK) {
    EXPECT_EQ(fault_of(d, closed), "") << what;
  } else {
    EXPECT_STRNE(relief_status_text(d.status), "unknown status") << what;
  }
  // sized by inspect's promises, a decode never lacks room
  EXPECT_NE(d.status, RELIEF_ERROR_ARGUMENT) << what;
  EXPECT_NE(d.status, RELIEF_ERROR_WORKSPACE) << what;
  EXPECT_NE(d.status, RELIEF_ERROR_OUTPUT) << what;
  return d.status;
}

TEST(Sha256, KnownAnswers) {
  EXPECT_EQ(sha256({}), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256({'a', 'b', 'c'}), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256(std::vector<uint8_t>(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Header, CompilesAloneAsCAndCpp) {
  const std::vector<uint8_t>& s = golden("torus").stream;
  EXPECT_EQ(relief_header_is_c(s.data(), s.size()), RELIEF_OK);
  EXPECT_EQ(relief_header_is_cpp(s.data(), s.size()), RELIEF_OK);
}

TEST(Golden, DecodesToItsHash) {
  ASSERT_GE(golden().size(), 4u);
  for (const Golden& g : golden()) {
    EXPECT_LE(g.stream.size(), 2048u) << g.name;
    const Decoded d = decode_bytes(g.stream);
    ASSERT_EQ(d.status, RELIEF_OK) << g.name;
    EXPECT_EQ(hash_of(d), g.hash) << g.name << ": see golden/README.md";
    EXPECT_EQ(fault_of(d, g.closed), "") << g.name;
    EXPECT_EQ(components_of(d), g.components) << g.name;
    if (!g.closed) {
      EXPECT_GT(DirectedEdges(d.indices, d.vertices()).open(), 0u) << g.name;
    }
  }
}

TEST(Golden, DecodesTheSameEveryTime) {
  for (const Golden& g : golden())
    EXPECT_EQ(hash_of(decode_bytes(g.stream)), hash_of(decode_bytes(g.stream)));
}

TEST(Inspect, TellsWhatTheStreamHolds) {
  for (const Golden& g : golden()) {
    const Decoded d = decode_bytes(g.stream);
    const relief_info& i = d.info;
    EXPECT_EQ(i.version, uint32_t(RELIEF_STREAM_VERSION));
    EXPECT_GE(i.patch_count, 1u);
    EXPECT_EQ(i.vertex_count, d.vertices()) << g.name;
    EXPECT_EQ(i.triangle_count, d.triangles()) << g.name;
    EXPECT_GE(i.vertex_capacity, i.vertex_count);
    EXPECT_GE(i.triangle_capacity, i.triangle_count);
    EXPECT_GT(i.pixel_count, 0u);
    EXPECT_GT(i.scale, 0);
    EXPECT_LE(i.masks_end, g.stream.size());
  }
}

TEST(Inspect, ErrorsOfArguments) {
  const std::vector<uint8_t>& s = golden("torus").stream;
  relief_info info;
  EXPECT_EQ(relief_inspect(nullptr, s.size(), nullptr, &info), RELIEF_ERROR_ARGUMENT);
  EXPECT_EQ(relief_inspect(nullptr, 0, nullptr, &info), RELIEF_ERROR_ARGUMENT);
  EXPECT_EQ(relief_inspect(s.data(), s.size(), nullptr, nullptr), RELIEF_ERROR_ARGUMENT);
  EXPECT_EQ(relief_inspect(s.data(), 0, nullptr, &info), RELIEF_ERROR_TRUNCATED);
  EXPECT_EQ(relief_inspect(s.data(), s.size(), nullptr, &info), RELIEF_OK);
}

TEST(Inspect, LeavesTheResultAloneAfterAnError) {
  const std::vector<uint8_t>& s = golden("torus").stream;
  relief_info info, before;
  std::memset(&info, 0x5a, sizeof info);
  before = info;
  for (size_t n = 0; n < s.size(); n++)
    if (relief_inspect(s.data(), n, nullptr, &info) != RELIEF_OK) {
      ASSERT_EQ(std::memcmp(&info, &before, sizeof info), 0) << n;
    } else {
      info = before;
    }
}

TEST(Inspect, BytesNeedNotBeAligned) {
  const std::vector<uint8_t>& s = golden("torus").stream;
  for (size_t shift = 1; shift < 16; shift++) {
    std::vector<uint8_t> bytes(shift, 0);
    bytes.insert(bytes.end(), s.begin(), s.end());
    relief_info info;
    EXPECT_EQ(relief_inspect(bytes.data() + shift, s.size(), nullptr, &info), RELIEF_OK);
  }
}

// A decode whose every part can be changed before it is run.
struct Call {
  explicit Call(const std::vector<uint8_t>& s) : data(s.data()), size(s.size()) {
    EXPECT_EQ(relief_inspect(data, size, nullptr, &info), RELIEF_OK);
    mesh.vertex_capacity = info.vertex_count;
    mesh.triangle_capacity = info.triangle_count;
    workspace_size = info.workspace_bytes;
  }

  // change: alters mesh and workspace just before the call
  relief_status run(const std::function<void(Call&)>& change = {}) {
    const HeapBlock positions(12 * size_t(mesh.vertex_capacity)), normals(12 * size_t(mesh.vertex_capacity)),
        colors(4 * size_t(mesh.vertex_capacity)), indices(12 * size_t(mesh.triangle_capacity)),
        memory(workspace_size);
    mesh.positions = positions.data(), mesh.normals = normals.data();
    mesh.colors = colors.data(), mesh.indices = indices.data();
    workspace = memory.data();
    if (change) change(*this);
    return relief_decode(data, size, &options, mesh_pointer, workspace, workspace_size);
  }

  const void* data;
  size_t size;
  relief_info info = {};
  relief_mesh mesh = {};
  relief_mesh* mesh_pointer = &mesh;
  relief_options options = {};
  uint8_t* workspace = nullptr;
  size_t workspace_size = 0;
};

TEST(Decode, ErrorsOfArguments) {
  const std::vector<uint8_t>& s = golden("torus").stream;
  auto status = [&](const std::function<void(Call&)>& change) { return Call(s).run(change); };
  EXPECT_EQ(status({}), RELIEF_OK);
  EXPECT_EQ(status([](Call& c) { c.data = nullptr; }), RELIEF_ERROR_ARGUMENT);
  EXPECT_EQ(status([](Call& c) { c.mesh_pointer = nullptr; }), RELIEF_ERROR_ARGUMENT);
  EXPECT_EQ(status([](Call& c) { c.mesh.positions = nullptr; }), RELIEF_ERROR_ARGUMENT);
  EXPECT_EQ(status([](Call& c) { c.mesh.indices = nullptr; }), RELIEF_ERROR_ARGUMENT);
  EXPECT_EQ(status([](Call& c) { c.workspace = nullptr; }), RELIEF_ERROR_ARGUMENT);
  EXPECT_EQ(status([](Call& c) { c.mesh.normals = c.mesh.colors = nullptr; }), RELIEF_OK);
  for (int shift = 1; shift < 16; shift++)
    EXPECT_EQ(status([=](Call& c) { c.workspace += shift, c.workspace_size -= size_t(shift); }),
              RELIEF_ERROR_ARGUMENT);
}

TEST(Decode, ExactSizesSufficeAndOneLessDoesNot) {
  for (const Golden& g : golden()) {
    Call exact(g.stream);
    EXPECT_EQ(exact.run(), RELIEF_OK) << g.name;
    EXPECT_EQ(exact.mesh.vertex_count, exact.info.vertex_count);
    EXPECT_EQ(exact.mesh.triangle_count, exact.info.triangle_count);
    Call vertex(g.stream), triangle(g.stream), workspace(g.stream);
    vertex.mesh.vertex_capacity--;
    EXPECT_EQ(vertex.run(), RELIEF_ERROR_OUTPUT) << g.name;
    triangle.mesh.triangle_capacity--;
    EXPECT_EQ(triangle.run(), RELIEF_ERROR_OUTPUT) << g.name;
    workspace.workspace_size--;
    EXPECT_EQ(workspace.run(), RELIEF_ERROR_WORKSPACE) << g.name;
  }
}

// Every smaller output and a sample of smaller workspaces: an error and nothing written beyond
// (AddressSanitizer).
TEST(Decode, AnySmallerOutputIsAnError) {
  const std::vector<uint8_t>& s = golden("one-patch").stream;
  const Call whole(s);
  for (uint32_t n = 0; n < whole.info.vertex_count; n += n < 64 ? 1 : 61) {
    Call c(s);
    c.mesh.vertex_capacity = n;
    ASSERT_EQ(c.run(), RELIEF_ERROR_OUTPUT) << n;
  }
  for (uint32_t n = 1; n < whole.info.triangle_count; n += n < 64 ? 1 : 61) {
    Call c(s);
    c.mesh.triangle_capacity = n;
    ASSERT_EQ(c.run(), RELIEF_ERROR_OUTPUT) << n;
  }
  for (size_t n = 1; n < whole.info.workspace_bytes; n += whole.info.workspace_bytes / 50) {
    Call c(s);
    c.workspace_size = n;
    ASSERT_EQ(c.run(), RELIEF_ERROR_WORKSPACE) << n;
  }
}

TEST(Decode, DoesNotDependOnWhatTheMemoryHeldBefore) {
  for (const Golden& g : golden()) {
    std::string hash;
    for (int fill : {0, 0xff, 0x7f}) {
      Call c(g.stream);
      Decoded d;
      const relief_status status = c.run([&](Call& call) {
        std::memset(call.workspace, fill, call.workspace_size);
        std::memset(call.mesh.positions, fill, 12 * size_t(call.mesh.vertex_capacity));
        std::memset(call.mesh.normals, fill, 12 * size_t(call.mesh.vertex_capacity));
        std::memset(call.mesh.colors, fill, 4 * size_t(call.mesh.vertex_capacity));
        std::memset(call.mesh.indices, fill, 12 * size_t(call.mesh.triangle_capacity));
        d.status =
            relief_decode(call.data, call.size, nullptr, &call.mesh, call.workspace, call.workspace_size);
        auto copy = [](auto& to, const void* from, uint32_t count) {
          using T = typename std::decay_t<decltype(to)>::value_type;
          to.assign(static_cast<const T*>(from), static_cast<const T*>(from) + 3 * size_t(count));
        };
        copy(d.positions, call.mesh.positions, call.mesh.vertex_count);
        copy(d.normals, call.mesh.normals, call.mesh.vertex_count);
        copy(d.indices, call.mesh.indices, call.mesh.triangle_count);
        const auto* colors = static_cast<const uint8_t*>(call.mesh.colors);
        if (call.info.has_colors) d.colors.assign(colors, colors + 4 * size_t(call.mesh.vertex_count));
      });
      ASSERT_EQ(status, RELIEF_OK);
      EXPECT_EQ(hash_of(d), g.hash) << g.name << " in memory of " << fill;
    }
  }
}

TEST(Limits, AreRespected) {
  for (const Golden& g : golden()) {
    const Decoded d = decode_bytes(g.stream);
    relief_limits l = {d.info.patch_count, d.info.pixel_count, d.info.vertex_count, 0};
    l.max_pixels = std::max(l.max_pixels, 64u);
    EXPECT_EQ(decode_bytes(g.stream, &l).status, RELIEF_OK) << g.name;
    EXPECT_LE(d.info.workspace_bytes, workspace_bound(l)) << g.name;
    for (uint32_t relief_limits::*field :
         {&relief_limits::max_patches, &relief_limits::max_pixels, &relief_limits::max_vertices})
      for (uint32_t value : {l.*field - 1, l.*field / 2, 0u}) {
        relief_limits tight = l;
        tight.*field = value;
        relief_info info;
        const relief_options options = options_of(&tight);
        EXPECT_EQ(relief_inspect(g.stream.data(), g.stream.size(), &options, &info), RELIEF_ERROR_LIMIT)
            << g.name;
        Call c(g.stream);
        c.options.limits = &tight;
        EXPECT_EQ(c.run(), RELIEF_ERROR_LIMIT) << g.name;
      }
  }
  EXPECT_EQ(relief_default_limits.max_patches, 1u << 20);
  EXPECT_EQ(relief_default_limits.max_pixels, 1u << 28);
  EXPECT_EQ(relief_default_limits.max_vertices, 1u << 27);
}

// Memory above its limit: within the masks that may only be for want of bytes.
TEST(Limits, OfMemory) {
  for (const Golden& g : golden()) {
    const relief_limits tight = {UINT32_MAX, UINT32_MAX, UINT32_MAX, 1},
                        wide = {UINT32_MAX, UINT32_MAX, UINT32_MAX, UINT64_MAX};
    const relief_options little = options_of(&tight), much = options_of(&wide);
    relief_info info;
    ASSERT_EQ(relief_inspect(g.stream.data(), g.stream.size(), &much, &info), RELIEF_OK) << g.name;
    auto inspected = [&](size_t size) { return relief_inspect(g.stream.data(), size, &little, &info); };
    const size_t masks_end = info.masks_end;
    EXPECT_EQ(inspected(g.stream.size()), RELIEF_ERROR_LIMIT) << g.name;
    EXPECT_EQ(inspected(masks_end), RELIEF_ERROR_LIMIT) << g.name;
    EXPECT_EQ(inspected(masks_end - 1), RELIEF_ERROR_TRUNCATED) << g.name;
  }
}

// Every status comes out of the decoder, found without knowing the format: damage a byte and look.
TEST(Status, EachIsReachableAndHasAText) {
  const std::vector<uint8_t>& s = golden("torus").stream;
  std::map<relief_status, int> seen;
  for (size_t i = 0; i < 64; i++)
    for (int flip : {0x01, 0x80, 0xff}) {
      std::vector<uint8_t> damaged = s;
      damaged[i] = uint8_t(damaged[i] ^ flip);
      seen[decode_bytes(damaged, &kSmall).status]++;
    }
  for (size_t n : {size_t(0), size_t(10), s.size() / 10}) seen[decode_exactly(s.data(), n).status]++;
  const relief_limits none = {0, 0, 0, 0};
  seen[decode_bytes(s, &none).status]++;
  seen[Call(s).run([](Call& c) { c.data = nullptr; })]++;
  seen[Call(s).run([](Call& c) { c.workspace_size--; })]++;
  seen[Call(s).run([](Call& c) { c.mesh.triangle_capacity--; })]++;
  seen[decode_bytes(s).status]++;
  std::set<std::string> texts;
  for (int i = 0; i <= int(RELIEF_ERROR_OUTPUT); i++) {
    EXPECT_GT(seen[relief_status(i)], 0) << relief_status_text(i);
    texts.insert(relief_status_text(i));
  }
  EXPECT_EQ(texts.size(), size_t(RELIEF_ERROR_OUTPUT) + 1) << "two statuses share a text";
  EXPECT_EQ(texts.count("unknown status"), 0u);
  EXPECT_STREQ(relief_status_text(999), "unknown status");
  EXPECT_STREQ(relief_status_text(-1), "unknown status");
}

// --- options ---

// The pixels' vertices of the whole mesh by patch: where each patch's begin, and the end.
std::vector<uint32_t> patch_begins(const Golden& g) {
  std::vector<uint32_t> begins = {0};
  const Decoded whole = decode_bytes(g.stream);
  for (uint32_t i = 0; i < whole.info.patch_count; i++) {
    std::vector<uint8_t> wanted(whole.info.patch_count, 0);
    wanted[i] = 1;
    const relief_options o = options_of(nullptr, RELIEF_POINTS, 0, wanted.data());
    begins.push_back(begins.back() +
                     uint32_t(decode_exactly(g.stream.data(), g.stream.size(), &o).vertices()));
  }
  return begins;
}

Decoded decode_by(const Golden& g, const relief_options& o) {
  return decode_exactly(g.stream.data(), g.stream.size(), &o);
}

TEST(Options, ThoseOutOfRangeAreErrors) {
  const std::vector<uint8_t>& s = golden("torus").stream;
  auto expect = [&](relief_status status, const relief_options& o) {
    relief_info info;
    EXPECT_EQ(relief_inspect(s.data(), s.size(), &o, &info), status);
    Call c(s);
    c.options = o;
    c.workspace_size *= 8, c.mesh.vertex_capacity *= 8;
    EXPECT_EQ(c.run(), status);
  };
  expect(RELIEF_OK, {});
  expect(RELIEF_OK, {nullptr, nullptr, RELIEF_MAX_LEVEL, 0, 0, 0, 0});
  expect(RELIEF_ERROR_ARGUMENT, {nullptr, nullptr, RELIEF_MAX_LEVEL + 1, 0, 0, 0, 0});
  expect(RELIEF_ERROR_ARGUMENT, {nullptr, nullptr, 0, 16, 0, 0, 0});
  expect(RELIEF_ERROR_ARGUMENT, {nullptr, nullptr, 0, RELIEF_SMOOTH | RELIEF_POINTS, 0, 0, 0});
  for (uint32_t flags : {0, int(RELIEF_QUANTISED)}) {
    const uint32_t position = flags ? 8 : 12, normal = flags ? 4 : 12;
    expect(RELIEF_OK, {nullptr, nullptr, 0, flags, position, normal, 0});
    expect(RELIEF_ERROR_ARGUMENT, {nullptr, nullptr, 0, flags, position - 4, 0, 0});
    expect(RELIEF_ERROR_ARGUMENT, {nullptr, nullptr, 0, flags, position + 2, 0, 0});
    if (normal > 4) expect(RELIEF_ERROR_ARGUMENT, {nullptr, nullptr, 0, flags, 0, normal - 4, 0});
    expect(RELIEF_ERROR_ARGUMENT, {nullptr, nullptr, 0, flags, 0, normal + 1, 0});
    expect(RELIEF_OK, {nullptr, nullptr, 0, flags, 0, 0, 8});
    expect(RELIEF_ERROR_ARGUMENT, {nullptr, nullptr, 0, flags, 0, 0, 6});
  }
  Call c(s);
  const relief_options points = {nullptr, nullptr, 0, RELIEF_POINTS, 0, 0, 0};
  EXPECT_EQ(relief_inspect(s.data(), s.size(), &points, &c.info), RELIEF_OK);
  c.workspace_size = c.info.workspace_bytes;
  EXPECT_EQ(c.run([&](Call& call) { call.options = points, call.mesh.indices = nullptr; }), RELIEF_OK);
  Call floats(s);
  EXPECT_EQ(floats.run([](Call& call) { call.options.flags = RELIEF_QUANTISED; }), RELIEF_ERROR_WORKSPACE);
}

TEST(Options, EachFormNeedsNoMoreThanInspectSays) {
  for (const Golden& g : golden())
    for (uint32_t flags = 0; flags < 16; flags++)
      for (uint32_t level = 0; level <= RELIEF_MAX_LEVEL; level++)
        for (uint32_t stride : {0, 24}) {
          if (flags & RELIEF_SMOOTH && flags & RELIEF_POINTS) continue;
          const relief_options o = {nullptr, nullptr, level, flags, stride, stride, 0};
          const Decoded d = decode_by(g, o);
          ASSERT_EQ(d.status, RELIEF_OK) << g.name << ", flags " << flags << ", level " << level;
          ASSERT_EQ(fault_of(d, g.closed && !d.points), "") << g.name << ", flags " << flags;
        }
}

// Where the whole surface has no border, a coarser one has none; it is as good a manifold, and near.
TEST(Level, CoarserMeshesAreManifoldsNearTheWhole) {
  for (const Golden& g : golden()) {
    const Decoded whole = decode_bytes(g.stream);
    for (uint32_t level = 1; level <= RELIEF_MAX_LEVEL; level++) {
      const Decoded d = decode_by(g, options_of(nullptr, 0, level));
      ASSERT_EQ(d.status, RELIEF_OK);
      EXPECT_EQ(fault_of(d, g.closed), "") << g.name << ", level " << level;
      // a quarter with every level but for the borders; thin shapes may vanish, and at one level more be
      // there
      EXPECT_LT(d.vertices() << level, whole.vertices()) << g.name << ", level " << level;
      if (level > 2) continue;
      ASSERT_GT(d.vertices(), 0u) << g.name;
      // each vertex to the nearest of the whole, in spacings of the coarser grid
      double worst = 0;
      const float* p = whole.positions.data();
      double spacing = 1e30;
      for (size_t k = 3; k < 30; k += 3)
        spacing = std::min(spacing, double(std::hypot(p[k] - p[0], p[k + 1] - p[1], p[k + 2] - p[2])));
      for (size_t i = 0; i < d.positions.size(); i += 3) {
        double nearest = 1e30;
        for (size_t k = 0; k < whole.positions.size(); k += 3)
          nearest = std::min(nearest, double(std::hypot(d.positions[i] - p[k], d.positions[i + 1] - p[k + 1],
                                                        d.positions[i + 2] - p[k + 2])));
        worst = std::max(worst, nearest);
      }
      EXPECT_LT(worst, 2.5 * spacing * (1 << level)) << g.name << ", level " << level;
    }
  }
}

TEST(Level, ReadsNothingOfFinerLevels) {
  for (const Golden& g : golden()) {
    if (g.stream[4] & kFlagBisk) continue;  // it codes all levels together
    const Decoded d = decode_by(g, options_of(nullptr, 0, 2));
    // without seams a prefix of all but the last bytes is as good
    const relief_options o = options_of(nullptr, 0, 2);
    const Decoded part = decode_exactly(g.stream.data(), g.stream.size() - 1, &o);
    ASSERT_EQ(part.status, RELIEF_OK);
    EXPECT_EQ(hash_of(part), hash_of(d)) << g.name;
  }
}

TEST(Points, AreTheVerticesOfThePatches) {
  for (const Golden& g : golden()) {
    const Decoded whole = decode_bytes(g.stream), points = decode_by(g, options_of(nullptr, RELIEF_POINTS));
    ASSERT_EQ(points.status, RELIEF_OK);
    EXPECT_EQ(points.vertices(), points.info.vertex_capacity) << g.name;
    EXPECT_EQ(points.triangles(), 0u);
    ASSERT_LE(points.positions.size(), whole.positions.size());
    EXPECT_TRUE(std::equal(points.positions.begin(), points.positions.end(), whole.positions.begin()))
        << g.name;
    size_t same = 0;  // normals differ at the borders of patches only
    for (size_t i = 0; i < points.normals.size(); i += 3)
      same += std::equal(&points.normals[i], &points.normals[i] + 3, &whole.normals[i]);
    EXPECT_GT(2 * same, points.vertices()) << g.name;
    if (whole.info.patch_count > 1) {
      EXPECT_LT(same, points.vertices()) << g.name;
    }
    EXPECT_EQ(fault_of(points), "") << g.name;
  }
}

TEST(Patches, SelectedOnesHaveTheSameVertices) {
  for (const Golden& g : golden()) {
    const Decoded whole = decode_bytes(g.stream);
    const std::vector<uint32_t> begins = patch_begins(g);
    const uint32_t n = whole.info.patch_count;
    std::mt19937 random(5);
    for (int round = 0; round < 20; round++) {
      std::vector<uint8_t> wanted(n);
      std::vector<float> expected;
      for (uint32_t i = 0; i < n; i++) {
        wanted[i] = uint8_t(random() % 2 * (1 + random() % 255));
        if (wanted[i])
          expected.insert(expected.end(), &whole.positions[3 * begins[i]],
                          &whole.positions[0] + 3 * begins[i + 1]);
      }
      const Decoded d = decode_by(g, options_of(nullptr, 0, 0, wanted.data()));
      ASSERT_EQ(d.status, RELIEF_OK) << g.name;
      ASSERT_GE(d.positions.size(), expected.size()) << g.name;
      EXPECT_TRUE(std::equal(expected.begin(), expected.end(), d.positions.begin())) << g.name;
      EXPECT_EQ(fault_of(d), "") << g.name;
    }
    const std::vector<uint8_t> all(n, 1), none(n, 0);
    EXPECT_EQ(hash_of(decode_by(g, options_of(nullptr, 0, 0, all.data()))), g.hash);
    EXPECT_EQ(decode_by(g, options_of(nullptr, 0, 0, none.data())).vertices(), 0u);
  }
}

// Whatever is decoded of a stream, its vertices keep their colours.
TEST(Colours, AreThoseOfTheWhole) {
  for (const char* name : {"coloured-torus", "coloured-bisk"}) {
    const Golden& g = golden(name);
    const Decoded whole = decode_bytes(g.stream), points = decode_by(g, options_of(nullptr, RELIEF_POINTS));
    ASSERT_EQ(whole.colors.size(), 4 * whole.vertices()) << name;
    EXPECT_TRUE(std::equal(points.colors.begin(), points.colors.end(), whole.colors.begin())) << name;
    const std::vector<uint32_t> begins = patch_begins(g);
    for (uint32_t i = 0; i < whole.info.patch_count; i++) {
      std::vector<uint8_t> wanted(whole.info.patch_count, 0);
      wanted[i] = 1;
      const Decoded one = decode_by(g, options_of(nullptr, 0, 0, wanted.data()));
      EXPECT_TRUE(
          std::equal(&whole.colors[4 * begins[i]], &whole.colors[0] + 4 * begins[i + 1], one.colors.begin()))
          << name << ", patch " << i;
    }
    for (uint32_t level = 1; level <= RELIEF_MAX_LEVEL; level++) {
      const Decoded coarse = decode_by(g, options_of(nullptr, 0, level));
      EXPECT_EQ(coarse.colors.size(), 4 * coarse.vertices()) << name << ", level " << level;
      EXPECT_EQ(fault_of(coarse), "") << name;
    }
    Call without(g.stream);
    EXPECT_EQ(without.run([](Call& c) { c.mesh.colors = nullptr; }), RELIEF_OK);
  }
}

// Vertices that gap closing adds take the colour of a neighbour.
TEST(Colours, OfAddedVerticesAreNotGrey) {
  const std::vector<uint8_t>& s = golden("coloured-torus").stream;
  const Decoded whole = decode_bytes(s);
  for (size_t i = 0; i < whole.colors.size(); i += 4)
    EXPECT_FALSE(whole.colors[i] == 128 && whole.colors[i + 1] == 128 && whole.colors[i + 2] == 128) << i;
}

// They come last: a prefix has the surface first, then luma, then the rest.
TEST(Colours, GetBetterWithEachPart) {
  for (const char* name : {"coloured-torus", "coloured-bisk"}) {
    const std::vector<uint8_t>& s = golden(name).stream;
    Parsed parsed;
    ASSERT_EQ(parse_header(s.data(), s.size(), relief_default_limits, parsed), RELIEF_OK);
    const Decoded whole = decode_bytes(s);
    double last = INFINITY;
    size_t size = parsed.colours_begin;
    for (int part = 0; part <= kChannels; part++) {
      const Decoded d = decode_bytes({s.begin(), s.begin() + ptrdiff_t(size)});
      EXPECT_EQ(d.positions, whole.positions) << name << ", part " << part;
      double sum = 0;
      for (size_t i = 0; i < whole.colors.size(); i++)
        sum += std::pow(double(d.colors[i]) - double(whole.colors[i]), 2);
      EXPECT_LT(sum, last) << name << ", part " << part;
      if (part == 0) {
        for (size_t i = 0; i < d.colors.size(); i++) ASSERT_EQ(d.colors[i], i % 4 == 3 ? 255 : 128);
      }
      last = sum;
      if (part < kChannels) size += parsed.header.colour_bytes[part];
    }
    EXPECT_EQ(size, s.size());
    EXPECT_EQ(last, 0);
  }
}

TEST(Forms, QuantisedNarrowAndStridedHoldTheSameMesh) {
  for (const Golden& g : golden()) {
    const Decoded whole = decode_bytes(g.stream);
    for (uint32_t level : {0u, 1u}) {
      const Decoded floats = decode_by(g, options_of(nullptr, 0, level));
      const uint32_t flags = RELIEF_QUANTISED | RELIEF_INDICES_16;
      const Decoded small = decode_by(g, {nullptr, nullptr, level, flags, 0, 0, 0});
      ASSERT_EQ(small.status, RELIEF_OK);
      EXPECT_EQ(small.indices, floats.indices);
      ASSERT_EQ(small.positions.size(), floats.positions.size());
      const double step = double(small.mesh.scale) / 32767, rounding = 1e-6 * whole.mesh.max[0];
      float widest = 0;
      for (int k = 0; k < 3; k++) {
        widest = std::max(widest, small.mesh.max[k] - small.mesh.min[k]);
        EXPECT_EQ(small.mesh.min[k], floats.mesh.min[k]);
        EXPECT_EQ(small.mesh.max[k], floats.mesh.max[k]);
      }
      EXPECT_NEAR(small.mesh.scale, widest / 2, 1e-5 * widest);
      for (size_t i = 0; i < floats.positions.size(); i++)
        ASSERT_NEAR(small.positions[i], floats.positions[i], step / 2 + std::fabs(rounding)) << g.name;
      for (size_t i = 0; i < floats.normals.size(); i++)
        ASSERT_NEAR(small.normals[i], 127 * floats.normals[i], 0.501) << g.name;
      const Decoded strided = decode_by(g, {nullptr, nullptr, level, 0, 28, 16, 12});
      EXPECT_EQ(hash_of(strided), hash_of(floats)) << g.name;
    }
  }
}

TEST(Forms, InterleavedArraysKeepWhatIsBetween) {
  const std::vector<uint8_t>& s = golden("torus").stream;
  const Decoded whole = decode_bytes(s);
  const relief_options o = {nullptr, nullptr, 0, RELIEF_QUANTISED, 20, 20, 0};
  relief_info info;
  ASSERT_EQ(relief_inspect(s.data(), s.size(), &o, &info), RELIEF_OK);
  const HeapBlock vertices(20 * size_t(info.vertex_count)), indices(12 * size_t(info.triangle_count)),
      workspace(info.workspace_bytes);
  std::memset(vertices.data(), 0xab, vertices.size());
  relief_mesh mesh = {};
  mesh.positions = vertices.data() + 4, mesh.normals = vertices.data() + 16, mesh.indices = indices.data();
  mesh.vertex_capacity = info.vertex_count, mesh.triangle_capacity = info.triangle_count;
  // the last vertex ends where its stride does: the arrays begin at 4 and 16
  ASSERT_EQ(relief_decode(s.data(), s.size(), &o, &mesh, workspace.data(), workspace.size()), RELIEF_OK);
  for (uint32_t v = 0; v < mesh.vertex_count; v++) {
    const uint8_t* p = vertices.data() + 20 * size_t(v);
    for (int i : {0, 1, 2, 3, 12, 13, 14, 15}) ASSERT_EQ(p[i], 0xab) << v;
    ASSERT_EQ(p[10] | p[11] | p[19], 0) << v;  // the fourth elements
  }
  EXPECT_EQ(mesh.vertex_count, whole.vertices());
}

TEST(Forms, NarrowIndicesOfTooManyVerticesAreRefused) {
  const std::vector<uint8_t>& s = golden("torus").stream;
  Parsed parsed;
  ASSERT_EQ(parse_header(s.data(), s.size(), relief_default_limits, parsed), RELIEF_OK);
  std::vector<float> positions(3 * 65536);
  std::vector<uint32_t> indices = {0, 1, 65535};
  std::vector<uint16_t> narrow(3);
  MeshWriter mesh = {positions.data(), indices.data(), 65536, 1, 65536, 1};
  relief_mesh out = {};
  out.positions = positions.data(), out.indices = narrow.data();
  const relief_options o = {nullptr, nullptr, 0, RELIEF_INDICES_16, 12, 12, 0};
  EXPECT_EQ(write_output(o, parsed.header, mesh, nullptr, out, best_leaves()), RELIEF_ERROR_OUTPUT);
  mesh.vertex_count = 65535;
  indices[2] = 65534;
  EXPECT_EQ(write_output(o, parsed.header, mesh, nullptr, out, best_leaves()), RELIEF_OK);
  EXPECT_EQ(narrow, (std::vector<uint16_t>{0, 1, 65534}));
}

TEST(Bounds, AreExact) {
  for (const Golden& g : golden()) {
    const Decoded d = decode_bytes(g.stream);
    for (size_t k = 0; k < 3; k++) {
      float low = d.positions[k], high = low;
      for (size_t i = k; i < d.positions.size(); i += 3) {
        low = std::min(low, d.positions[i]);
        high = std::max(high, d.positions[i]);
      }
      EXPECT_EQ(d.mesh.min[k], low) << g.name;
      EXPECT_EQ(d.mesh.max[k], high) << g.name;
      const double reach = double(d.info.scale) * kCoordinateLimit;  // what can be known without decoding
      EXPECT_GE(low, d.info.origin[k] - reach);
      EXPECT_LE(high, d.info.origin[k] + reach);
    }
  }
}

// A mask of any kind becomes one that can be meshed, and a clean one stays as it is.
TEST(CoarseMask, IsCleanAfterwards) {
  std::mt19937 random(11);
  for (int round = 0; round < 3000; round++) {
    const uint32_t w = 1 + random() % 24, h = 1 + random() % 24, holes = 1 + random() % 30;
    const ptrdiff_t stride = ptrdiff_t(w) + 4;
    std::vector<uint8_t> mask(size_t(stride) * (h + 4), 0);
    uint8_t* const at = &mask[2 * size_t(stride) + 2];
    for (uint32_t y = 0; y < h; y++)
      for (uint32_t x = 0; x < w; x++) at[y * stride + x] = random() % holes != 0;
    std::vector<uint32_t> queue(w * h);
    tidy_mask(at, w, h, stride, queue.data());
    std::vector<uint8_t> once = mask;
    for (uint8_t m : mask) ASSERT_LE(m, 1);
    tidy_mask(at, w, h, stride, queue.data());
    ASSERT_EQ(mask, once);
    for (int y = 0; y < int(h); y++)
      for (int x = 0; x < int(w); x++) {
        if (!at[y * stride + x]) continue;
        // sides that leave the pixel: directed edges of triangles with no triangle on the other side
        int cells = 0, shared = 0;
        auto in = [&](int px, int py) { return int(at[py * stride + px]); };
        auto covered = [&](int cx, int cy) {
          return in(cx, cy) + in(cx + 1, cy) + in(cx, cy + 1) + in(cx + 1, cy + 1) >= 3;
        };
        const bool c[4] = {covered(x, y), covered(x - 1, y), covered(x - 1, y - 1), covered(x, y - 1)};
        const int side[4] = {in(x, y + 1), in(x - 1, y), in(x, y - 1), in(x + 1, y)};
        for (int k = 0; k < 4; k++) cells += c[k], shared += c[k] && c[(k + 1) % 4] && side[k];
        ASSERT_GT(cells, 0) << x << ", " << y;
        ASSERT_LE(cells - shared, 1) << x << ", " << y;
      }
  }
}

TEST(Prefix, EachDecodesOrIsTooShort) {
  for (const Golden& g : golden()) {
    const uint32_t masks_end = decode_bytes(g.stream).info.masks_end;
    size_t least = 0;  // the first that is not too short
    for (size_t n = 0; n < g.stream.size(); n++) {
      const std::vector<uint8_t> prefix(g.stream.begin(), g.stream.begin() + ptrdiff_t(n));
      const relief_status status = expect_error_or_good_mesh(prefix, g.name + " cut to " + std::to_string(n),
                                                             g.closed && n >= masks_end);
      // a prefix is as good as the stream or too short, never corrupt
      EXPECT_EQ(status, least == 0 && status != RELIEF_OK ? RELIEF_ERROR_TRUNCATED : RELIEF_OK)
          << g.name << " cut to " << n;
      if (status == RELIEF_OK && least == 0) least = n;
    }
    EXPECT_GT(least, 29u) << g.name;
    EXPECT_LE(least, masks_end) << g.name;
  }
}

// Within the masks a prefix has the first of the patches, as flat as without any coefficient, and what is
// made of it is what is made of these patches alone.
TEST(Prefix, WithinTheMasksHasTheFirstPatches) {
  size_t parts = 0;  // prefixes that have some of the patches
  for (const Golden& g : golden()) {
    const relief_info info = decode_bytes(g.stream).info;
    std::vector<uint8_t> wanted(info.patch_count);
    const relief_options o = options_of(nullptr, 0, 0, wanted.data());
    uint32_t first = 0;  // so many are wanted
    Decoded alone = decode_exactly(g.stream.data(), info.masks_end, &o);
    for (size_t n = 0; n < info.masks_end; n++) {
      const Decoded part = decode_exactly(g.stream.data(), n);
      if (part.status != RELIEF_OK) continue;
      while (!same(part, alone)) {
        ASSERT_LT(first, info.patch_count) << g.name << ", " << n;
        wanted[first++] = 1;
        alone = decode_exactly(g.stream.data(), info.masks_end, &o);
      }
      parts += first > 0 && first < info.patch_count;
    }
  }
  EXPECT_GT(parts, 100u);
}

// More bytes bring the surface nearer to that of the whole stream.
TEST(Prefix, ConvergesToTheWhole) {
  for (const Golden& g : golden()) {
    const Decoded whole = decode_bytes(g.stream);
    // the pixels' vertices come first and are the same in number
    auto distance = [&](size_t bytes) {
      const Decoded d = decode_exactly(g.stream.data(), bytes);
      double sum = 0;
      const size_t n = std::min(d.positions.size(), whole.positions.size());
      for (size_t i = 0; i < n; i++) sum += std::pow(double(d.positions[i]) - whole.positions[i], 2);
      return sum;
    };
    const size_t begin = whole.info.masks_end, end = g.stream.size();
    EXPECT_GT(distance(begin), 0) << g.name;
    EXPECT_LT(distance((begin + end) / 2), 0.5 * distance(begin)) << g.name;
    EXPECT_LT(distance(end - 8), 0.1 * distance(begin)) << g.name;
    EXPECT_EQ(distance(end), 0) << g.name;
  }
}

// A few bytes at a time, and a mesh after each: what relief_decode makes of the prefix.
TEST(Arriving, EveryMeshIsThatOfThePrefix) {
  for (const Golden& g : golden()) {
    Arriving stream;
    const size_t masks_end = decode_bytes(g.stream).info.masks_end;
    for (size_t n = 0; n <= g.stream.size(); n += 1 + n % 5) {
      const Decoded part = stream.decode(g.stream.data(), n), alone = decode_exactly(g.stream.data(), n);
      ASSERT_TRUE(same(part, alone)) << g.name << ", " << n;
      ASSERT_EQ(stream.taken(), n < masks_end ? 0 : n) << g.name;
    }
    EXPECT_EQ(hash_of(stream.decode(g.stream.data(), g.stream.size())), g.hash) << g.name << " again";
  }
}

TEST(Arriving, InPiecesOfAnySizeWithAnyOptions) {
  std::mt19937 random(41);
  for (const Golden& g : golden())
    for (uint32_t level : {0u, 1u, 3u})
      for (uint32_t flags : {0u, uint32_t(RELIEF_SMOOTH), uint32_t(RELIEF_POINTS),
                             uint32_t(RELIEF_QUANTISED | RELIEF_INDICES_16)}) {
        const relief_options o = options_of(nullptr, flags, level);
        Arriving stream;
        for (size_t n = decode_bytes(g.stream).info.masks_end;;) {
          if (random() % 2) {
            ASSERT_EQ(stream.take(g.stream.data(), n, &o), RELIEF_OK) << g.name;
          } else {
            ASSERT_TRUE(same(stream.decode(g.stream.data(), n, &o), decode_exactly(g.stream.data(), n, &o)))
                << g.name << ", " << n << " bytes, level " << level << ", flags " << flags;
          }
          if (n == g.stream.size()) break;
          n = std::min(g.stream.size(), n + random() % 400);
        }
        EXPECT_TRUE(same(stream.decode(g.stream.data(), g.stream.size(), &o),
                         decode_exactly(g.stream.data(), g.stream.size(), &o)))
            << g.name;
      }
}

TEST(Arriving, RefusesWhatIsNotTheSameStream) {
  for (const char* name : {"torus", "bisk-torus"}) {
    const std::vector<uint8_t>& s = golden(name).stream;
    relief_info info;
    ASSERT_EQ(relief_inspect(s.data(), s.size(), nullptr, &info), RELIEF_OK);
    const HeapBlock workspace(info.workspace_bytes);
    std::memset(workspace.data(), 0xa5, workspace.size());
    size_t taken = 0;
    auto more = [&](const std::vector<uint8_t>& bytes, size_t size, const relief_options* o = nullptr) {
      return relief_decode_more(bytes.data(), size, o, nullptr, workspace.data(), workspace.size(), &taken);
    };
    taken = 1;  // but nothing was begun
    EXPECT_EQ(more(s, s.size()), RELIEF_ERROR_ARGUMENT);
    taken = s.size() + 1;
    EXPECT_EQ(more(s, s.size()), RELIEF_ERROR_ARGUMENT);
    EXPECT_EQ(
        relief_decode_more(s.data(), s.size(), nullptr, nullptr, workspace.data(), workspace.size(), nullptr),
        RELIEF_ERROR_ARGUMENT);
    taken = 0;
    EXPECT_EQ(more(s, 29), RELIEF_ERROR_TRUNCATED);
    EXPECT_EQ(taken, 0u);
    EXPECT_EQ(more(s, info.masks_end - 1), RELIEF_OK);  // but nothing is kept of it
    EXPECT_EQ(taken, 0u);
    taken = 1;
    EXPECT_EQ(more(s, info.masks_end - 1), RELIEF_ERROR_ARGUMENT);
    taken = 0;
    EXPECT_EQ(more(s, info.masks_end), RELIEF_OK);
    EXPECT_EQ(taken, info.masks_end);
    std::vector<uint8_t> other = s;
    other[20] ^= 1;
    EXPECT_EQ(more(other, s.size()), RELIEF_ERROR_ARGUMENT);
    const relief_options coarser = options_of(nullptr, 0, 1);
    EXPECT_EQ(more(s, s.size(), &coarser), RELIEF_ERROR_ARGUMENT);
    EXPECT_EQ(taken, info.masks_end);
    EXPECT_EQ(more(s, s.size()), RELIEF_OK);
    other = s;
    other.push_back(0);
    EXPECT_EQ(more(other, other.size()), RELIEF_ERROR_CORRUPT);
    EXPECT_EQ(taken, s.size());
  }
}

TEST(Hostile, BytesAfterTheStreamDoNoHarm) {
  for (const Golden& g : golden())
    for (int fill : {0, 1, 0x7f, 0x80, 0xff}) {
      std::vector<uint8_t> longer = g.stream;
      longer.insert(longer.end(), 100, uint8_t(fill));
      expect_error_or_good_mesh(longer, g.name + " and bytes of " + std::to_string(fill));
    }
}

// Every place of the header and the begin of the patch table gets extreme values of every kind of field:
// numbers of one to five bytes at their ends, floats that are none. Knows nothing of where which field is.
TEST(Hostile, ExtremeValuesInEveryField) {
  const std::vector<std::vector<uint8_t>> values = {
      {0},
      {1},
      {0x7f},
      {0xff},
      {0xff, 0x7f},                    // the same in base 128
      {0xff, 0xff, 0x03},              // 2^16 - 1
      {0x80, 0x80, 0x80, 0x80, 0x01},  // 2^28
      {0xff, 0xff, 0xff, 0xff, 0x0f},  // 2^32 - 1
      {0xff, 0xff, 0xff, 0xff, 0x7f},  // too much
      {0xff, 0xff, 0xff, 0xff, 0xff},
      {0, 0, 0, 0},
      {0, 0, 0, 0x80},           // -0
      {1, 0, 0, 0},              // the least denormal float
      {0, 0, 0x80, 0x00},        // the least normal one
      {0xff, 0xff, 0x7f, 0x7f},  // the largest
      {0xff, 0xff, 0x7f, 0xff},
      {0, 0, 0x80, 0x7f},  // infinity
      {0, 0, 0x80, 0xff},
      {0, 0, 0xc0, 0x7f},  // NaN
      {1, 0, 0x80, 0x7f},  // signalling NaN
      {0xff, 0xff, 0xff, 0xff},
      {0, 0, 0x80, 0x3f},  // 1
  };
  for (const char* name : {"torus", "one-patch", "coloured-bisk"}) {
    const std::vector<uint8_t>& s = golden(name).stream;
    for (size_t at = 0; at < 64; at++)
      for (size_t v = 0; v < values.size(); v++)
        for (size_t length = 0; length <= 5; length++) {  // bytes that make room for the value
          std::vector<uint8_t> damaged(s.begin(), s.begin() + ptrdiff_t(at));
          damaged.insert(damaged.end(), values[v].begin(), values[v].end());
          damaged.insert(damaged.end(), s.begin() + ptrdiff_t(at + length), s.end());
          expect_error_or_good_mesh(damaged, std::string(name) + " at " + std::to_string(at) + ", value " +
                                                 std::to_string(v) + " for " + std::to_string(length) +
                                                 " bytes");
          if (::testing::Test::HasFailure()) return;
        }
  }
}

// Changes 1 to 4 bytes from `begin` to `end`, each to any value.
std::vector<uint8_t> mutated(const std::vector<uint8_t>& s, size_t begin, size_t end, std::mt19937& random) {
  std::vector<uint8_t> m = s;
  for (uint32_t n = 1 + random() % 4; n > 0; n--) m[begin + random() % (end - begin)] = uint8_t(random());
  return m;
}

// Of 100,000 damaged streams. A third of the rounds keep to header, table and masks, which mostly end at a
// check, a third to what comes behind. least: how many of the streams have to decode.
void mutate(const char* name, int rounds, int least, uint32_t seed = 12345) {
  const std::vector<uint8_t>& s = golden(name).stream;
  const uint32_t masks_end = decode_bytes(s).info.masks_end;
  std::mt19937 random(seed);
  std::map<relief_status, int> seen;
  for (int i = 0; i < rounds; i++) {
    const std::vector<uint8_t> bytes =
        mutated(s, i % 3 == 2 ? masks_end : 0, i % 3 == 1 ? masks_end : s.size(), random);
    seen[expect_error_or_good_mesh(bytes, std::string(name) + ", change " + std::to_string(i))]++;
    if (::testing::Test::HasFailure()) return;
  }
  std::printf("%s: %d of %d decode, each to a manifold mesh\n", name, seen[RELIEF_OK], rounds);
  // the test reaches behind the first checks
  EXPECT_GE(seen[RELIEF_OK], least);
  EXPECT_GT(seen[RELIEF_ERROR_CORRUPT], rounds / 10);
}

class HostileOnePatch : public ::testing::TestWithParam<uint32_t> {};
TEST_P(HostileOnePatch, RandomChanges) { mutate("one-patch", 15000, 6700, GetParam()); }
INSTANTIATE_TEST_SUITE_P(Seeds, HostileOnePatch, ::testing::Values(1, 2, 3));
TEST(Hostile, RandomChangesOfATorus) { mutate("torus", 30000, 1000); }
TEST(Hostile, RandomChangesOfAHemisphere) { mutate("hemisphere", 10000, 3000); }
TEST(Hostile, RandomChangesOfColours) { mutate("coloured-torus", 5000, 1000); }
TEST(Hostile, RandomChangesOfTwoSpheres) { mutate("nested-spheres", 5000, 1000); }
TEST(Hostile, RandomChangesOfPinholes) { mutate("pinholes", 5000, 500); }

// The seams of a stream without colours are its last part.
uint32_t seam_bytes(const std::vector<uint8_t>& stream) {
  Parsed parsed;
  EXPECT_EQ(parse_header(stream.data(), stream.size(), relief_default_limits, parsed), RELIEF_OK);
  return parsed.header.seam_bytes;
}

// Whatever the seams say, tubes among them, the mesh is a manifold.
TEST(Hostile, RandomChangesOfSeams) {
  for (const char* name : {"pinholes", "hemisphere", "bisk-torus"}) {
    const std::vector<uint8_t>& s = golden(name).stream;
    ASSERT_GE(seam_bytes(s), 4u) << name;
    std::mt19937 random(99);
    int decoded = 0;
    for (int i = 0; i < 2000 && !::testing::Test::HasFailure(); i++)
      decoded += expect_error_or_good_mesh(mutated(s, s.size() - seam_bytes(s), s.size(), random),
                                           std::string(name) + ", seams " + std::to_string(i)) == RELIEF_OK;
    EXPECT_GT(decoded, 50) << name;
  }
}

TEST(Hostile, RandomBytesAfterTheMasks) {
  std::mt19937 random(7);
  for (const Golden& g : golden()) {
    const uint32_t masks_end = decode_bytes(g.stream).info.masks_end;
    for (int i = 0; i < 300; i++) {
      std::vector<uint8_t> bytes = g.stream;
      for (size_t k = masks_end; k < bytes.size(); k++) bytes[k] = uint8_t(random());
      const relief_status status =
          expect_error_or_good_mesh(bytes, g.name + ", noise " + std::to_string(i), g.closed);
      // whatever the heights are, there is a mesh (unless the seams behind, which may be malformed now)
      if (seam_bytes(g.stream) == 0) {
        EXPECT_EQ(status, RELIEF_OK) << g.name << ", noise " << i;
      }
    }
  }
}

TEST(Hostile, RandomBytes) {
  std::mt19937 random(99);
  for (int i = 0; i < 20000; i++) {
    std::vector<uint8_t> bytes(random() % 200);
    for (uint8_t& b : bytes) b = uint8_t(random());
    const std::vector<uint8_t>& s = golden("torus").stream;
    // with a true beginning of up to the whole header
    const size_t keep = std::min<size_t>(random() % 48, bytes.size());
    std::copy(s.begin(), s.begin() + ptrdiff_t(keep), bytes.begin());
    expect_error_or_good_mesh(bytes, "noise " + std::to_string(i));
  }
}

// --- docs/RELIEF_patch_compression/tables.json ---

// A float's shortest decimal that is read back as the same float.
std::string decimal(float f) {
  char text[32];
  for (int digits = 1; digits < 10; digits++) {
    std::snprintf(text, sizeof text, "%.*g", digits, double(f));
    if (std::strtof(text, nullptr) == f) break;
  }
  return text;
}

template <class List, class Text>
std::string row(const List& list, Text text) {
  std::string s;
  for (const auto& v : list) s += (s.empty() ? "[" : ", ") + text(v);
  return s + "]";
}

std::string whole(int v) { return std::to_string(v); }

// The tables as they are compiled into the decoder, in the form of the document's file.
std::string tables_text() {
  std::string s = "{\n  \"version\": " + whole(RELIEF_STREAM_VERSION) +
                  ",\n  \"lifting\": " + row(kLift, decimal) + ",\n  \"low_scale\": " + decimal(kLowScale) +
                  ",\n  \"logistic_knots\": ";
  std::vector<int> knots;
  for (int x = -2048; x <= 2048; x += 128) knots.push_back(Logistic::squash(std::clamp(x, -2047, 2047)));
  s += row(knots, whole) + ",\n  \"activity_weights\": [";
  for (int t = 0; t < 3; t++) {
    const ActivityWeights& w = kActivityWeights[t];
    s += std::string(t ? "," : "") + "\n    {\"W\": " + whole(w.W) + ", \"N\": " + whole(w.N) +
         ", \"NW\": " + whole(w.NW) + ", \"NE\": " + whole(w.NE) + ", \"WW\": " + whole(w.WW) +
         ", \"NN\": " + whole(w.NN) +
         ", \"parent\": " + row(std::vector<int>{w.parent, w.parent_across, w.parent_down}, whole) +
         ", \"siblings\": [";
    for (int i = 0; i < t; i++)
      s += (i ? ", " : "") +
           row(std::vector<int>{w.sibling[i].here, w.sibling[i].across, w.sibling[i].down}, whole);
    s += "]}";
  }
  s += "\n  ],\n  \"first_nonzero\": [" + row(kFirstNonzero[0], whole) + ",\n    " +
       row(kFirstNonzero[1], whole) + "],\n  \"first_greater\": [";
  for (int a = 0; a < kActivities; a++) s += (a ? ", " : "") + row(kFirstGreater[a], whole);
  const auto rows = [](const auto& list) { return row(list, whole); };
  const auto blocks = [&](const auto& list) { return row(list, rows); };
  return s +
         "],\n  \"nonzero_move\": " + row(kNonzeroMove, [&](const auto& list) { return row(list, blocks); }) +
         ",\n  \"greater_move\": " + rows(kGreaterMove) + ",\n  \"first_sign\": " + blocks(kFirstSign) +
         ",\n  \"first_tail\": " + blocks(kFirstTail) + ",\n  \"first_low\": " + rows(kFirstLow) + "\n}\n";
}

TEST(Document, ListsTheTablesOfTheDecoder) {
  const std::vector<uint8_t> file =
      read_bytes(RELIEF_SOURCE_DIR "/docs/RELIEF_patch_compression/tables.json");
  EXPECT_EQ(std::string(file.begin(), file.end()), tables_text());
}

TEST(Document, ListsTheGoldenStreams) {
  const std::vector<uint8_t> file =
      read_bytes(RELIEF_SOURCE_DIR "/docs/RELIEF_patch_compression/bitstream.md");
  const std::string text(file.begin(), file.end());
  for (const Golden& g : golden()) {
    const std::string line =
        "| " + g.name + ".relief | " + std::to_string(g.stream.size()) + " | `" + g.hash + "` |";
    EXPECT_NE(text.find(line), std::string::npos) << "section 16 has no line\n" << line;
  }
}

// --- the leaves: every level that this machine has gives what the one without vectors gives ---

std::vector<std::pair<std::string, const Leaves*>> vector_levels() {
  std::vector<std::pair<std::string, const Leaves*>> levels;
  if (const Leaves* leaves = leaves_of(Level::kVector)) levels.emplace_back("vector", leaves);
  if (const Leaves* leaves = leaves_of(Level::kAvx2)) levels.emplace_back("AVX2", leaves);
  return levels;
}

std::vector<uint8_t> decode_bytes_with(const Leaves& leaves, const std::vector<uint8_t>& stream) {
  relief_info info;
  EXPECT_EQ(relief_inspect(stream.data(), stream.size(), nullptr, &info), RELIEF_OK);
  std::vector<float> positions(3 * size_t(info.vertex_capacity)), normals(positions.size());
  std::vector<uint32_t> indices(3 * size_t(info.triangle_capacity));
  std::vector<uint8_t> colors(info.has_colors ? 4 * size_t(info.vertex_capacity) : 0);
  struct alignas(16) Block {
    uint8_t bytes[16];
  };
  std::vector<Block> workspace((info.workspace_bytes + 15) / 16);
  relief_mesh mesh = {};
  mesh.positions = positions.data(), mesh.normals = normals.data(), mesh.indices = indices.data();
  mesh.colors = colors.data();
  mesh.vertex_capacity = info.vertex_capacity, mesh.triangle_capacity = info.triangle_capacity;
  EXPECT_EQ(decode_with(leaves, stream.data(), stream.size(), nullptr, &mesh, workspace.data(),
                        info.workspace_bytes),
            RELIEF_OK);
  std::vector<uint8_t> bytes;
  auto add = [&](const void* data, size_t size) {
    bytes.insert(bytes.end(), static_cast<const uint8_t*>(data), static_cast<const uint8_t*>(data) + size);
  };
  add(positions.data(), 12 * size_t(mesh.vertex_count));
  add(normals.data(), 12 * size_t(mesh.vertex_count));
  add(indices.data(), 12 * size_t(mesh.triangle_count));
  add(colors.data(), info.has_colors ? 4 * size_t(mesh.vertex_count) : 0);
  return bytes;
}

TEST(Leaves, AllLevelsDecodeToTheSameBytes) {
  const Leaves* scalar = leaves_of(Level::kScalar);
  ASSERT_NE(scalar, nullptr);
  for (const Golden& g : golden()) {
    relief_info info;
    ASSERT_EQ(relief_inspect(g.stream.data(), g.stream.size(), nullptr, &info), RELIEF_OK);
    for (size_t size = g.stream.size(); size >= info.masks_end; size -= 1 + size / 5) {
      const std::vector<uint8_t> prefix(g.stream.begin(), g.stream.begin() + ptrdiff_t(size));
      const std::vector<uint8_t> expected = decode_bytes_with(*scalar, prefix);
      for (const auto& [name, leaves] : vector_levels())
        EXPECT_EQ(decode_bytes_with(*leaves, prefix), expected)
            << g.name << ", " << size << " bytes, " << name;
    }
  }
}

// What a leaf may be given and golden streams do not have: large values, every length, ragged masks.
struct RandomRows {
  static constexpr size_t kStride = 80, kRows = 9, kMiddle = 4 * kStride + 2;
  int round;
  uint32_t n;
  std::vector<int32_t> q;
  std::vector<float> values;
  std::vector<uint8_t> mask;
  std::vector<uint16_t> magnitudes;

  RandomRows(int r, std::mt19937& random)
      : round(r),
        n(1 + random() % 64),
        q(kStride * kRows),
        values(q.size()),
        mask(q.size()),
        magnitudes(q.size()) {
    for (size_t i = 0; i < q.size(); i++) {
      q[i] = int32_t(random() >> (11 + random() % 21)) * (random() & 1 ? 1 : -1);
      values[i] = float(q[i]) * 0.37f;
      mask[i] = random() % 8 != 0 || round % 3 == 0;
      magnitudes[i] = uint16_t(random() % (kMagnitudeCap + 1));
    }
  }
};

// All that leaves may have written, of copies of the rows.
class Written {
 public:
  template <class T>
  void keep(const std::vector<T>& v) {
    all.insert(all.end(), v.begin(), v.end());
  }
  std::vector<double> all;
};

void run_context_leaves(const Leaves& leaves, const RandomRows& r, Written& out) {
  constexpr size_t kStride = RandomRows::kStride, kMiddle = RandomRows::kMiddle;
  const uint16_t* const m = r.magnitudes.data();
  std::vector<uint16_t> wide(kStride), sum(kStride, 5), halves(kStride, 6);
  std::vector<uint8_t> near(kStride), edge(kStride);
  leaves.magnitudes(r.q.data() + kMiddle, wide.data(), r.n);
  leaves.weigh_above(m + kMiddle, m + kStride, {50, 8, 30, 12}, sum.data(), near.data(), r.n);
  leaves.weigh_around(m + kStride, m + kMiddle, m + 6 * kStride, {12, 1, 0}, sum.data(), r.n);
  leaves.add_doubled(m + kMiddle, halves.data(), r.n);
  leaves.edges(&r.mask[kMiddle], kStride, edge.data(), r.n);
  for (auto* v : {&wide, &sum, &halves}) v->resize(r.n), out.keep(*v);
  for (auto* v : {&near, &edge}) v->resize(r.n), out.keep(*v);
}

void run_wavelet_leaves(const Leaves& leaves, const RandomRows& r, Written& out) {
  constexpr size_t kStride = RandomRows::kStride, kMiddle = RandomRows::kMiddle;
  const uint8_t* const mask = &r.mask[kMiddle];
  std::vector<uint8_t> low(kStride), high(kStride);
  leaves.split_mask(mask, low.data(), high.data(), r.n);
  out.keep(low), out.keep(high);
  std::vector<float> rows(r.values), restored(kStride + kBlock);
  leaves.dequantise(&r.q[kMiddle], 1.7f, &rows[kMiddle], r.n);
  leaves.scale(&rows[2 * kStride], 0.443f, r.n);
  leaves.lift(&rows[4 * kStride], &rows[3 * kStride], &rows[5 * kStride], 0.443f, r.n);
  leaves.join_row(&rows[6 * kStride], &rows[kStride], &rows[7 * kStride], r.n);
  out.keep(rows);
  const float* const z = &r.values[kMiddle];
  leaves.restore_row({z, z - 2 * kStride, z - kStride, z + kStride, z + 2 * kStride, kStride, mask, kStride},
                     50, restored.data(), r.n);
  for (uint32_t i = 0; i < r.n; i++) out.all.push_back(mask[i] ? restored[i] : 0);
}

void run_mesh_leaves(const Leaves& leaves, const RandomRows& r, Written& out) {
  constexpr size_t kStride = RandomRows::kStride, kMiddle = RandomRows::kMiddle;
  const uint8_t* const mask = &r.mask[kMiddle];
  std::vector<float> vectors(r.values), box(6), placed(3 * kStride);
  std::vector<int32_t> heights(kStride), small(r.q);
  std::vector<uint8_t> flags(kStride);
  leaves.normalise(&vectors[0], r.n / 3);
  leaves.bounds(&r.values[3], r.n, &box[0], &box[3]);
  leaves.place(&r.values[3], 0.3f, &vectors[kStride], r.n / 3);
  leaves.place_row({{1, 2, 3}, {0.5f, -7, 11}, {0.6f, 0, -0.8f}, r.round % 5}, -9, &r.values[kMiddle],
                   placed.data(), r.n);
  leaves.heights(&r.values[kMiddle], heights.data(), r.n);
  out.keep(box), out.keep(vectors), out.keep(placed), out.keep(heights);
  leaves.count_cells(mask, kStride, flags.data(), r.n);
  out.keep(flags), out.all.push_back(leaves.any_stray(mask, mask, kStride, r.n));
  leaves.border_cells(mask, kStride, flags.data(), r.n);
  out.keep(flags);
  for (int32_t& v : small) v %= kCoordinateLimit;
  leaves.diagonals(&small[kMiddle], kStride, mask, kStride, flags.data(), r.n);
  out.keep(flags);
}

std::vector<double> run_leaves(const Leaves& leaves, const RandomRows& rows) {
  Written out;
  run_context_leaves(leaves, rows, out);
  run_wavelet_leaves(leaves, rows, out);
  run_mesh_leaves(leaves, rows, out);
  return out.all;
}

TEST(Leaves, AllLevelsGiveTheSameOnRandomRows) {
  std::mt19937 random(7);
  for (int round = 0; round < 400; round++) {
    const RandomRows rows(round, random);
    const std::vector<double> expected = run_leaves(*leaves_of(Level::kScalar), rows);
    for (const auto& [name, leaves] : vector_levels())
      ASSERT_EQ(run_leaves(*leaves, rows), expected) << name << ", n = " << rows.n;
  }
}

}  // namespace
}  // namespace relief
