#pragma once

// Scenes made by hand for the tests of the offline stage.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <numbers>
#include <span>
#include <vector>

#include "precompute/import/scene.h"
#include "precompute/patches/patch_model.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce::test {

/// A scene without triangles and with one material.
inline Scene empty_scene(const Float3& reflectance = {0.5F, 0.5F, 0.5F}) {
  Scene scene;
  scene.name = "test";
  scene.hash = "xxh3:00000000000000000000000000000000";
  Material material;
  material.base_color = reflectance;
  scene.materials.push_back(material);
  return scene;
}

/// Adds a flat convex polygon, counter-clockwise from its front, as a fan of triangles.
inline void add_polygon(Scene& scene, std::span<const glm::dvec3> corner,
                        std::uint32_t material = 0) {
  const auto first = static_cast<std::uint32_t>(scene.position.size());
  const glm::dvec3 normal =
      glm::normalize(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
  for (const glm::dvec3& p : corner) {
    scene.position.push_back(to_float3(p));
    scene.normal.push_back(to_float3(normal));
    scene.base_color_texcoord.push_back({0, 0});
    scene.emissive_texcoord.push_back({0, 0});
    scene.vertex_color.push_back({1, 1, 1});
  }
  for (std::uint32_t k = 2; k < corner.size(); ++k) {
    scene.triangle.push_back({first, first + k - 1, first + k});
    scene.triangle_material.push_back(material);
  }
}

/// The faces of a box in the order in which they are added, two triangles each.
enum class Face : std::uint8_t { kLowX, kHighX, kLowY, kHighY, kLowZ, kHighZ };

/// The six faces of the box [low, high]; `inwards` makes a room of it.
inline void add_box(Scene& scene, const glm::dvec3& low, const glm::dvec3& high, bool inwards,
                    std::uint32_t material = 0) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      std::array<glm::dvec3, 4> corner;
      for (int k = 0; k < 4; ++k) {
        corner[k][axis] = side == 1 ? high[axis] : low[axis];
        corner[k][u] = (k == 1 || k == 2) ? high[u] : low[u];
        corner[k][v] = k >= 2 ? high[v] : low[v];
      }
      // (u, v) turns counter-clockwise seen from +axis.
      const bool faces_up = inwards ? side == 0 : side == 1;
      if (!faces_up) std::swap(corner[1], corner[3]);
      add_polygon(scene, corner, material);
    }
  }
}

/// Removes a face of one of the boxes that a scene consists of; of several the last first.
inline void remove_face(Scene& scene, Face face, std::size_t box = 0) {
  const auto first = static_cast<std::ptrdiff_t>(12 * box + 2 * static_cast<std::size_t>(face));
  const auto remove = [first](auto& of_triangle) {
    of_triangle.erase(of_triangle.begin() + first, of_triangle.begin() + first + 2);
  };
  remove(scene.triangle);
  remove(scene.triangle_material);
}

/// A ball of radius 1 around the origin, of longitudes and latitudes; `inwards` makes a dome of it.
inline void add_ball(Scene& scene, int longitudes, int latitudes, bool inwards,
                     std::uint32_t material = 0) {
  const auto point = [&](int i, int j) {
    const double theta = std::numbers::pi * i / latitudes;
    const double phi = 2 * std::numbers::pi * j / longitudes;
    return glm::dvec3(std::sin(theta) * std::cos(phi), std::cos(theta),
                      -std::sin(theta) * std::sin(phi));
  };
  for (int i = 0; i < latitudes; ++i) {
    for (int j = 0; j < longitudes; ++j) {
      std::vector<glm::dvec3> corner = {point(i, j), point(i + 1, j), point(i + 1, j + 1),
                                        point(i, j + 1)};
      if (i == 0) corner.erase(corner.begin() + 3);              // the pole
      if (i == latitudes - 1) corner.erase(corner.begin() + 1);  // the other
      if (inwards) std::reverse(corner.begin(), corner.end());
      add_polygon(scene, corner, material);
    }
  }
}

inline RayTracer make_tracer(const PatchModel& model) {
  return make_surface_tracer(model.mesh);
}

/// The material of a patch's triangles.
inline std::uint32_t material_of(const PatchModel& model, std::size_t patch) {
  const auto found = std::ranges::find(model.mesh.triangle_patch, patch);
  return model.mesh.triangle_material[found - model.mesh.triangle_patch.begin()];
}

/// A room of 4 x 3 x 5 m in which a block hangs, all of one material.
inline Scene room_with_block(const Float3& reflectance) {
  Scene scene = empty_scene(reflectance);
  add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  add_box(scene, {1, 0.5, 1}, {2, 1.2, 2.5}, false);
  return scene;
}

/// The room with a block that stands on its floor and one that hangs in the air.
inline Scene furnished_room(const Float3& reflectance = {0.5F, 0.5F, 0.5F}) {
  Scene scene = empty_scene(reflectance);
  add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  add_box(scene, {1, 0, 1}, {2, 1.2, 2.5}, false);
  add_box(scene, {2.5, 1.5, 3}, {3, 2, 4}, false);
  return scene;
}

/// The same with materials 1 and 2 for the blocks.
inline Scene furnished_room(const Float3& walls, const Float3& standing, const Float3& hanging) {
  constexpr std::size_t kBox = 12;  // triangles
  Scene scene = furnished_room(walls);
  scene.materials.resize(3, scene.materials[0]);
  scene.materials[1].base_color = standing;
  scene.materials[2].base_color = hanging;
  for (std::size_t t = kBox; t < 3 * kBox; ++t) {
    scene.triangle_material[t] = static_cast<std::uint32_t>(t / kBox);
  }
  return scene;
}

}  // namespace rebounce::test
