#include "precompute/import/gltf_meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <map>
#include <optional>
#include <utility>

#include "precompute/import/gltf_instances.h"
#include "precompute/import/gltf_primitives.h"
#include "rebounce/error.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce::gltf {
namespace {

// A triangle counts as having no area if its height is below 1e-12 of its longest side, far below
// the precision of positions in single precision.
constexpr double kDegenerateAreaRatio = 1e-12;

// A shorter stored normal has no reliable direction; quantised ones are within 1 % of 1.
constexpr double kShortestNormal = 1e-6;

// The matrix of cofactors: the inverse transpose times the determinant, which exists even if the
// inverse does not. It maps the cross product of two vectors to that of their images.
glm::dmat3 cofactors(const glm::dmat3& m) {
  return {glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1])};
}

// Transforms one primitive to the world and appends its valid triangles to the scene, as part of
// the last of its placed meshes.
class Placement {
 public:
  Placement(const Primitive& primitive, const glm::dmat4& world, std::uint32_t lightmap_page,
            Scene& scene)
      : primitive_(primitive),
        lightmap_page_(lightmap_page),
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
      scene_.triangle_mesh.push_back(static_cast<std::uint32_t>(scene_.placed_meshes.size() - 1));
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

  // The unit normal of a triangle of this primitive; empty if it has no area.
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

  // The vertex of the scene for a corner. It is shared if the asset has normals; otherwise the
  // triangle has its own and the surface is faceted.
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
    scene_.lightmap_texcoord.push_back(
        primitive_.lightmap_texcoord.empty()
            ? LightmapTexcoord{}
            : LightmapTexcoord{primitive_.lightmap_texcoord[local], lightmap_page_});
    return static_cast<std::uint32_t>(scene_.position.size() - 1);
  }

  const Primitive& primitive_;
  std::uint32_t lightmap_page_;
  bool mirrored_;
  glm::dmat3 normal_transform_;
  Scene& scene_;
  std::vector<std::uint32_t> scene_vertex_;  // [v] vertex in the scene, kNone if there is none yet
  std::vector<Float3> position_;             // [v] in the world
};

// The meshes of an asset, each read at its first use.
class Meshes {
 public:
  Meshes(const Document& document, std::span<const MaterialTexcoords> texcoords, Warnings& warnings)
      : document_(document),
        texcoords_(texcoords),
        warnings_(warnings),
        primitives_(document.model.meshes.size()) {}

  const std::vector<Primitive>& operator[](int mesh) {
    const auto index = static_cast<std::size_t>(mesh);
    auto& primitives = primitives_[index];
    if (!primitives) primitives = read_primitives(document_, index, texcoords_, warnings_);
    return *primitives;
  }

 private:
  const Document& document_;
  std::span<const MaterialTexcoords> texcoords_;
  Warnings& warnings_;
  std::vector<std::optional<std::vector<Primitive>>> primitives_;
};

// Gives every placement of a mesh a page of the lightmap; the primitives of a mesh are unwrapped
// together.
class LightmapPages {
 public:
  explicit LightmapPages(std::vector<std::string>& names) : names_(names) {}

  // kNone if the primitive has no place in a lightmap. `use` is the number of the placed node.
  std::uint32_t page(const Primitive& primitive, std::size_t use, std::size_t instance) {
    if (primitive.lightmap_texcoord.empty()) return kNone;
    const auto [entry, is_new] =
        pages_.try_emplace({use, instance}, static_cast<std::uint32_t>(names_.size()));
    if (is_new) names_.push_back(primitive.mesh_name);
    return entry->second;
  }

 private:
  std::vector<std::string>& names_;
  std::map<std::pair<std::size_t, std::size_t>, std::uint32_t> pages_;
};

// Calls visit(primitive, placed, instances) for each use of a primitive with triangles. Instances
// are read again at every call: keeping those of all nodes could fill the memory.
template <typename Visit>
void for_each_use(const Document& document, std::span<const PlacedNode> nodes, Meshes& meshes,
                  const Visit& visit) {
  for (const PlacedNode& placed : nodes) {
    const int mesh = document.model.nodes[placed.node].mesh;
    if (mesh < 0) continue;
    std::optional<Instances> instances;
    for (const Primitive& primitive : meshes[mesh]) {
      if (primitive.triangle.empty()) continue;
      if (!instances) instances = read_instances(document, placed.node);
      visit(primitive, placed, *instances);
    }
  }
}

// Reserves memory for all triangles, so that the scene never exists twice while it grows.
void reserve(const Document& document, std::span<const PlacedNode> nodes, Meshes& meshes,
             Scene& scene) {
  std::size_t triangles = 0;
  std::size_t vertices = 0;
  for_each_use(document, nodes, meshes,
               [&](const Primitive& primitive, const PlacedNode&, const Instances& instances) {
                 const std::size_t corners = 3 * primitive.triangle.size();
                 const std::size_t used = primitive.normal.empty()
                                              ? corners
                                              : std::min(corners, primitive.position.size());
                 add_triangles(triangles, instances.count * primitive.triangle.size());
                 vertices += instances.count * used;
               });
  scene.triangle.reserve(triangles);
  scene.triangle_material.reserve(triangles);
  scene.triangle_mesh.reserve(triangles);
  scene.position.reserve(vertices);
  scene.normal.reserve(vertices);
  scene.base_color_texcoord.reserve(vertices);
  scene.emissive_texcoord.reserve(vertices);
  scene.vertex_color.reserve(vertices);
  scene.lightmap_texcoord.reserve(vertices);
}

}  // namespace

void import_meshes(const Document& document, std::span<const PlacedNode> nodes,
                   std::span<const MaterialTexcoords> texcoords, Scene& scene, Warnings& warnings) {
  Meshes meshes(document, texcoords, warnings);
  reserve(document, nodes, meshes, scene);
  LightmapPages pages(scene.lightmap_page);
  const PlacedNode* last = nullptr;
  for_each_use(
      document, nodes, meshes,
      [&](const Primitive& primitive, const PlacedNode& placed, const Instances& instances) {
        if (std::exchange(last, &placed) != &placed) {
          const tinygltf::Node& node = document.model.nodes[placed.node];
          const auto mesh = static_cast<std::size_t>(node.mesh);
          scene.placed_meshes.push_back({document.model.meshes[mesh].name, node.name});
        }
        const auto use = static_cast<std::size_t>(&placed - nodes.data());
        for (std::size_t i = 0; i < instances.count; ++i) {
          Placement(primitive, placed.world * instances.transform(i), pages.page(primitive, use, i),
                    scene)
              .append();
        }
      });
  if (scene.lightmap_page.empty()) scene.lightmap_texcoord = {};
}

}  // namespace rebounce::gltf
