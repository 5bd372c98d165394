#include "gltf/read_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "gltf/geometry.h"

namespace relief {

namespace {

using Matrix = Eigen::Matrix4d;

Matrix compose(const Eigen::Vector3d& t, const Eigen::Quaterniond& r, const Eigen::Vector3d& s) {
  Eigen::Affine3d transform = Eigen::Translation3d(t) * Eigen::Affine3d(r) * Eigen::Scaling(s);
  return transform.matrix();
}

Matrix local_transform(const tinygltf::Node& node) {
  if (node.matrix.size() == 16) return Eigen::Map<const Matrix>(node.matrix.data());  // both are column-major
  Eigen::Vector3d t = Eigen::Vector3d::Zero(), s = Eigen::Vector3d::Ones();
  Eigen::Quaterniond r = Eigen::Quaterniond::Identity();
  if (node.translation.size() == 3) t = Eigen::Map<const Eigen::Vector3d>(node.translation.data());
  if (node.scale.size() == 3) s = Eigen::Map<const Eigen::Vector3d>(node.scale.data());
  if (node.rotation.size() == 4) {
    r.coeffs() = Eigen::Map<const Eigen::Vector4d>(node.rotation.data());  // both are x, y, z, w
    if (r.norm() > 0) r.normalize();
  }
  return compose(t, r, s);
}

// Roots of the default scene; without one, of all scenes; without scenes, all nodes that are nobody's child.
std::vector<int> root_nodes(const tinygltf::Model& model) {
  std::vector<int> roots;
  if (model.defaultScene >= 0) return model.scenes.at(size_t(model.defaultScene)).nodes;
  for (const tinygltf::Scene& scene : model.scenes)
    roots.insert(roots.end(), scene.nodes.begin(), scene.nodes.end());
  if (model.scenes.empty()) {
    std::vector<bool> is_child(model.nodes.size());
    for (const tinygltf::Node& node : model.nodes)
      for (int child : node.children) is_child.at(size_t(child)) = true;
    for (size_t i = 0; i < model.nodes.size(); i++)
      if (!is_child[i]) roots.push_back(int(i));
  }
  std::sort(roots.begin(), roots.end());
  roots.erase(std::unique(roots.begin(), roots.end()), roots.end());
  return roots;
}

// The transforms of EXT_mesh_gpu_instancing, or the identity.
std::vector<Matrix> instances(const Document& document, const tinygltf::Model& model, size_t node) {
  const Json* extensions = find(document.json["nodes"][node], "extensions");
  const Json* instancing = extensions ? find(*extensions, "EXT_mesh_gpu_instancing") : nullptr;
  const Json* attributes = instancing ? find(*instancing, "attributes") : nullptr;
  auto read = [&](const char* name) {
    const Json* accessor = attributes ? find(*attributes, name) : nullptr;
    return accessor ? read_float3(document, model, accessor->get<int>()) : Float3s();
  };
  if (!attributes) return {Matrix::Identity()};
  if (attributes->contains("ROTATION"))
    throw InputError("node " + std::to_string(node) + ": rotated instances are not read");
  Float3s translations = read("TRANSLATION"), scales = read("SCALE");
  size_t count = std::max(translations.size(), scales.size());
  std::vector<Matrix> transforms;
  for (size_t i = 0; i < count; i++) {
    Eigen::Vector3d t = Eigen::Vector3d::Zero(), s = Eigen::Vector3d::Ones();
    for (int k = 0; k < 3; k++) {
      if (i < translations.size()) t[k] = translations[i][size_t(k)];
      if (i < scales.size()) s[k] = scales[i][size_t(k)];
    }
    transforms.push_back(compose(t, Eigen::Quaterniond::Identity(), s));
  }
  return transforms;
}

class Scene {
 public:
  TriangleMesh mesh;

  void add(const TriangleMesh& part, const Matrix& transform) {
    constexpr size_t kMost = std::numeric_limits<int32_t>::max();
    if (part.positions.size() > kMost - mesh.positions.size() ||
        part.triangles.size() > kMost - mesh.triangles.size())
      throw InputError("has too many vertices or triangles");
    Eigen::Matrix3d linear = transform.topLeftCorner<3, 3>();
    bool mirrored = linear.determinant() < 0;
    // Normals turn with the cofactors, which exist for singular matrices too.
    Eigen::Matrix3d cofactors;
    for (int k = 0; k < 3; k++)
      cofactors.col(k) = linear.col((k + 1) % 3).cross(linear.col((k + 2) % 3)) * (mirrored ? -1 : 1);
    uint32_t base = uint32_t(mesh.positions.size());
    for (const auto& p : part.positions) add_position((transform * point(p).homogeneous()).head<3>());
    if (part.normals.empty()) has_normals_ = false;
    if (has_normals_)
      for (const auto& n : part.normals) mesh.normals.push_back(floats((cofactors * point(n)).normalized()));
    if (!part.colors.empty()) {
      mesh.colors.resize(base, kWhite);
      mesh.colors.insert(mesh.colors.end(), part.colors.begin(), part.colors.end());
    }
    for (auto t : part.triangles) {
      if (mirrored) std::swap(t[1], t[2]);
      mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
    }
  }

  void finish() {
    if (!has_normals_) mesh.normals.clear();
    if (!mesh.colors.empty()) mesh.colors.resize(mesh.positions.size(), kWhite);
  }

 private:
  static constexpr std::array<uint8_t, 4> kWhite = {255, 255, 255, 255};  // of parts without colours
  static Eigen::Vector3d point(const std::array<float, 3>& p) { return {p[0], p[1], p[2]}; }
  static std::array<float, 3> floats(const Eigen::Vector3d& p) {
    return {float(p[0]), float(p[1]), float(p[2])};
  }
  void add_position(const Eigen::Vector3d& p) {
    mesh.positions.push_back(floats(p));
    for (float c : mesh.positions.back())
      if (!std::isfinite(c))
        throw InputError("vertex " + std::to_string(mesh.positions.size() - 1) +
                         " is not finite in world space");
  }
  bool has_normals_ = true;
};

// Triangles and points apart.
struct Scenes {
  Scene triangles, points;
};

void add_mesh(Scenes& scenes, const Document& document, const tinygltf::Model& model, size_t mesh,
              const std::vector<Matrix>& transforms) {
  for (size_t p = 0; p < model.meshes[mesh].primitives.size(); p++) {
    const Json& json = document.json["meshes"][mesh]["primitives"][p];
    if (!is_triangles(json) && !is_points(json)) continue;
    const TriangleMesh part = read_primitive(document, model, mesh, p);
    if (is_triangles(json) && part.triangles.empty() && !document.decoding.points) continue;
    Scene& scene = part.triangles.empty() ? scenes.points : scenes.triangles;
    for (const Matrix& transform : transforms) scene.add(part, transform);
  }
}

}  // namespace

TriangleMesh read_gltf_mesh(const std::string& path, const DecodeOptions& options) {
  Document document = load_document(path);
  document.decoding = options;
  tinygltf::Model model = geometry_model(document);
  Scenes scenes;
  struct Visit {
    int node;
    Matrix parent;
  };
  std::vector<Visit> stack;
  for (int root : root_nodes(model)) stack.push_back({root, Matrix::Identity()});
  std::reverse(stack.begin(), stack.end());
  std::vector<bool> seen(model.nodes.size());
  while (!stack.empty()) {
    Visit visit = stack.back();
    stack.pop_back();
    size_t i = size_t(visit.node);
    const tinygltf::Node& node = model.nodes.at(i);
    // glTF 2.0, 3.5.2: the nodes are disjoint trees.
    if (seen[i]) throw InputError("node " + std::to_string(i) + " is its own descendant or has two parents");
    seen[i] = true;
    Matrix world = visit.parent * local_transform(node);
    if (node.mesh >= 0) {
      std::vector<Matrix> transforms = instances(document, model, i);
      for (Matrix& transform : transforms) transform = world * transform;
      add_mesh(scenes, document, model, size_t(node.mesh), transforms);
    }
    for (size_t c = node.children.size(); c-- > 0;) stack.push_back({node.children[c], world});
  }
  Scene& scene = scenes.triangles.mesh.triangles.empty() ? scenes.points : scenes.triangles;
  scene.finish();
  if (scene.mesh.positions.empty()) throw InputError("has no vertices");
  return std::move(scene.mesh);
}

}  // namespace relief
