#include "gltf_meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <optional>

#include "gltf_primitives.h"
#include "rebounce/runtime/float3_glm.h"
#include "rebounce/transfer/error.h"

namespace rebounce::gltf {
namespace {

// More than can be precomputed; a small file could otherwise fill the memory by using a mesh often.
constexpr std::size_t kMaxTriangles = std::size_t{1} << 26;

// A triangle without area: its height is 1e-12 of its longest side, far below what positions in
// single precision can express.
constexpr double kDegenerateAreaRatio = 1e-12;

// Below this a stored normal has no direction worth the name: quantised ones are within 1 % of 1.
constexpr double kShortestNormal = 1e-6;

// The matrix of cofactors: the inverse transpose times the determinant, and of use where the
// inverse does not exist. It takes the cross product of two vectors to that of their images.
glm::dmat3 cofactors(const glm::dmat3& m) {
  return {glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1])};
}

// Puts one primitive into the world and appends what is left of it to the scene.
class Placement {
 public:
  Placement(const Primitive& primitive, const glm::dmat4& world, Scene& scene)
      : primitive_(primitive),
        mirrored_(glm::determinant(glm::dmat3(world)) < 0),
        normal_transform_(cofactors(glm::dmat3(world)) * (mirrored_ ? -1.0 : 1.0)),
        scene_(scene),
        scene_vertex_(primitive.position.size(), kNone) {
    place_positions(world);
  }

  void append() {
    for (Uint3 triangle : primitive_.triangle) {
      if (mirrored_) std::swap(triangle[1], triangle[2]);
      const auto normal = geometric_normal(triangle);
      if (!normal) {
        ++scene_.degenerate_triangle_count;
        continue;
      }
      Uint3 placed{};
      for (std::size_t corner = 0; corner < 3; ++corner) {
        placed[corner] = vertex(triangle[corner], *normal);
      }
      scene_.triangle.push_back(placed);
      scene_.triangle_material.push_back(primitive_.material);
    }
  }

 private:
  void place_positions(const glm::dmat4& world) {
    position_.reserve(primitive_.position.size());
    for (const Float3& local : primitive_.position) {
      position_.push_back(to_float3(glm::dvec3(world * glm::dvec4(to_dvec3(local), 1))));
      const Float3& placed = position_.back();
      if (!std::isfinite(placed[0]) || !std::isfinite(placed[1]) || !std::isfinite(placed[2])) {
        throw Error(
            fmt::format("{}: vertex {} is placed at no finite position; check its node's transform",
                        primitive_.place, position_.size() - 1));
      }
    }
  }

  // The unit normal of a triangle of this primitive, empty where it has no area.
  std::optional<glm::dvec3> geometric_normal(const Uint3& triangle) const {
    const glm::dvec3 a = to_dvec3(position_[triangle[0]]);
    const glm::dvec3 b = to_dvec3(position_[triangle[1]]);
    const glm::dvec3 c = to_dvec3(position_[triangle[2]]);
    const glm::dvec3 cross = glm::cross(b - a, c - a);
    const double twice_area = glm::length(cross);
    const double longest_squared =
        std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)});
    if (!(twice_area / 2 > kDegenerateAreaRatio * longest_squared)) return {};
    return cross / twice_area;
  }

  // The scene's vertex for a corner: shared where the asset has normals, the triangle's own where
  // it has none and the surface is faceted.
  std::uint32_t vertex(std::uint32_t local, const glm::dvec3& geometric) {
    if (primitive_.normal.empty()) return add_vertex(local, geometric);
    if (scene_vertex_[local] == kNone) {
      scene_vertex_[local] = add_vertex(local, shading_normal(local, geometric));
    }
    return scene_vertex_[local];
  }

  glm::dvec3 shading_normal(std::uint32_t local, const glm::dvec3& geometric) const {
    const glm::dvec3 stored = to_dvec3(primitive_.normal[local]);
    const glm::dvec3 placed = normal_transform_ * stored;
    const double length = glm::length(placed);
    const bool usable =
        glm::length(stored) > kShortestNormal && length > 0 && std::isfinite(length);
    return usable ? placed / length : geometric;
  }

  std::uint32_t add_vertex(std::uint32_t local, const glm::dvec3& normal) {
    scene_.position.push_back(position_[local]);
    scene_.normal.push_back(to_float3(normal));
    scene_.base_color_texcoord.push_back(primitive_.base_color_texcoord[local]);
    scene_.emissive_texcoord.push_back(primitive_.emissive_texcoord[local]);
    scene_.vertex_color.push_back(primitive_.vertex_color[local]);
    return static_cast<std::uint32_t>(scene_.position.size() - 1);
  }

  const Primitive& primitive_;
  bool mirrored_;
  glm::dmat3 normal_transform_;
  Scene& scene_;
  std::vector<std::uint32_t> scene_vertex_;  // [v] where a vertex went, kNone before
  std::vector<Float3> position_;             // [v] in the world
};

void warn_of_node(const tinygltf::Node& node, Warnings& warnings) {
  if (node.skin >= 0) warnings.count("{} skinned meshes are taken in their bind pose");
  if (node.extensions.contains("EXT_mesh_gpu_instancing")) {
    warnings.count("{} nodes use EXT_mesh_gpu_instancing: their mesh is taken once");
  }
}

}  // namespace

void import_meshes(const Document& document, std::span<const PlacedNode> nodes,
                   std::span<const MaterialTexcoords> texcoords, Scene& scene, Warnings& warnings) {
  const tinygltf::Model& model = document.model;
  std::vector<std::optional<std::vector<Primitive>>> meshes(model.meshes.size());
  std::size_t triangle_count = 0;
  for (const PlacedNode& placed : nodes) {
    const tinygltf::Node& node = model.nodes[placed.node];
    if (node.mesh < 0) continue;
    warn_of_node(node, warnings);
    const auto index = static_cast<std::size_t>(node.mesh);
    if (!meshes[index]) meshes[index] = read_primitives(document, index, texcoords, warnings);
    for (const Primitive& primitive : *meshes[index]) {
      triangle_count += primitive.triangle.size();
      if (triangle_count > kMaxTriangles) {
        throw Error(fmt::format("more than {} triangles; simplify the scene", kMaxTriangles));
      }
      Placement(primitive, placed.world, scene).append();
    }
  }
}

}  // namespace rebounce::gltf
