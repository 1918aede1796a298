#pragma once

// A scene made by hand for the tests of what draws.

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "transfer/file/transfer_data.h"

namespace rebounce::test {

/// Scenes of rectangles, one patch each, every vertex with the value of its patch.
class SceneBuilder {
 public:
  SceneBuilder() { data_.mesh.weight_begin.push_back(0); }

  std::uint32_t add_material(const Float3& base_color, const Float3& luminance = {0, 0, 0}) {
    Material material;
    material.base_color = base_color;
    material.emitted_luminance = luminance;
    data_.materials.push_back(material);
    return static_cast<std::uint32_t>(data_.materials.size() - 1);
  }

  // The front is the side from which a, b, c, d run counter-clockwise.
  void add_rectangle(const std::array<Float3, 4>& corner, std::uint32_t material) {
    add_side(corner, material);
    data_.mesh.back_triangle.insert(data_.mesh.back_triangle.end(), 2, kNone);
  }

  // All rectangles so far get a second side. Called once, last.
  void make_double_sided() {
    const std::size_t count = data_.mesh.triangle.size();
    for (std::size_t first = 0; first < count; first += 2) {
      const Uint3 t = data_.mesh.triangle[first];
      const Uint3 u = data_.mesh.triangle[first + 1];
      const auto at = [&](std::uint32_t v) { return data_.mesh.position[v]; };
      const auto back = static_cast<std::uint32_t>(data_.mesh.triangle.size());
      add_side({at(t[0]), at(u[2]), at(t[2]), at(t[1])}, data_.mesh.triangle_material[first]);
      // The second side's first triangle covers the first side's second one.
      data_.mesh.back_triangle[first] = back + 1;
      data_.mesh.back_triangle[first + 1] = back;
    }
  }

  std::size_t patch_count() const { return data_.patches.size(); }
  TransferData& data() { return data_; }

 private:
  void add_side(const std::array<Float3, 4>& corner, std::uint32_t material) {
    const Float3 e1 = minus(corner[1], corner[0]), e2 = minus(corner[3], corner[0]);
    Float3 normal{e1[1] * e2[2] - e1[2] * e2[1], e1[2] * e2[0] - e1[0] * e2[2],
                  e1[0] * e2[1] - e1[1] * e2[0]};
    const float area = std::hypot(normal[0], normal[1], normal[2]);
    for (float& axis : normal) axis /= area;
    DisplayMesh& mesh = data_.mesh;
    const auto v = static_cast<std::uint32_t>(mesh.position.size());
    const auto patch = static_cast<std::uint32_t>(data_.patches.size());
    for (int k = 0; k < 4; ++k) {
      mesh.position.push_back(corner[k]);
      mesh.normal.push_back(normal);
      mesh.base_color_texcoord.push_back({k == 1 || k == 2 ? 1.0F : 0.0F, k >= 2 ? 1.0F : 0.0F});
      mesh.emissive_texcoord.push_back({0, 0});
      mesh.vertex_color.push_back({1, 1, 1});
      mesh.weight_patch.push_back(patch);
      mesh.weight.push_back(1);
      mesh.weight_begin.push_back(static_cast<std::uint32_t>(mesh.weight.size()));
    }
    for (const Uint3& t : {Uint3{v, v + 1, v + 2}, Uint3{v, v + 2, v + 3}}) {
      mesh.triangle.push_back(t);
      mesh.triangle_patch.push_back(patch);
      mesh.triangle_material.push_back(material);
    }
    const Material& m = data_.materials[material];
    PatchTable& patches = data_.patches;
    patches.area.push_back(area);
    patches.centroid.push_back(corner[0]);
    patches.normal.push_back(normal);
    patches.reflectance.push_back(m.base_color);
    patches.emitted_exitance.push_back({std::numbers::pi_v<float> * m.emitted_luminance[0],
                                        std::numbers::pi_v<float> * m.emitted_luminance[1],
                                        std::numbers::pi_v<float> * m.emitted_luminance[2]});
    patches.sky_visibility.push_back(1);
    patches.absorbed.push_back(0);
  }

  static Float3 minus(const Float3& a, const Float3& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  }

  TransferData data_;
};

/// A floor at height 0 from -half to half, facing up.
inline std::array<Float3, 4> floor_corners(float half) {
  return {{{-half, 0, half}, {half, 0, half}, {half, 0, -half}, {-half, 0, -half}}};
}

}  // namespace rebounce::test
