#include "rebounce/precompute/patch_model.h"

#include <algorithm>
#include <numbers>
#include <unordered_map>

#include "rebounce/precompute/lit_sides.h"
#include "rebounce/precompute/texture_sampling.h"
#include "rebounce/runtime/float3_glm.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

class PatchModelBuilder {
 public:
  PatchModelBuilder(Scene scene, const SubdivisionSettings& settings) : scene_(std::move(scene)) {
    model_.scene_triangle_count = scene_.triangle.size();
    const std::vector<std::uint8_t> sides = find_lit_sides(scene_);
    std::vector<std::uint8_t> patches_per_triangle(sides.size());
    std::transform(sides.begin(), sides.end(), patches_per_triangle.begin(),
                   [](std::uint8_t s) { return s == kBothSides ? 2 : 1; });
    const std::vector<std::uint32_t> source = subdivide(scene_, patches_per_triangle, settings);
    sides_.reserve(source.size());
    for (const std::uint32_t t : source) sides_.push_back(sides[t]);
  }

  PatchModel build() {
    copy_surface();
    add_second_sides();
    for (std::uint32_t t = 0; t < model_.mesh.triangle.size(); ++t) add_patch_of(t);
    if (clamped_count_ > 0) {
      model_.warnings.push_back("the reflectance of " + std::to_string(clamped_count_) +
                                " patches was clamped to 0.99");
    }
    return std::move(model_);
  }

 private:
  bool is_double_sided(std::uint32_t t) const {
    return scene_.materials[scene_.triangle_material[t]].double_sided;
  }

  void copy_surface() {
    DisplayMesh& mesh = model_.mesh;
    mesh.position = scene_.position;
    mesh.normal = scene_.normal;
    mesh.base_color_texcoord = scene_.base_color_texcoord;
    mesh.emissive_texcoord = scene_.emissive_texcoord;
    mesh.vertex_color = scene_.vertex_color;
    mesh.triangle = scene_.triangle;
    mesh.triangle_material = scene_.triangle_material;
    mesh.back_triangle.assign(scene_.triangle.size(), kNone);
  }

  /// Appends a copy with reversed winding and normals of every double-sided triangle.
  void add_second_sides() {
    DisplayMesh& mesh = model_.mesh;
    std::unordered_map<std::uint32_t, std::uint32_t> back_vertex;
    const auto back_of = [&](std::uint32_t v) {
      const auto [entry, is_new] =
          back_vertex.try_emplace(v, static_cast<std::uint32_t>(mesh.position.size()));
      if (is_new) {
        const Float3 position = mesh.position[v], normal = mesh.normal[v];
        const Float2 base_color = mesh.base_color_texcoord[v], emissive = mesh.emissive_texcoord[v];
        const Float3 color = mesh.vertex_color[v];
        mesh.position.push_back(position);
        mesh.normal.push_back({-normal[0], -normal[1], -normal[2]});
        mesh.base_color_texcoord.push_back(base_color);
        mesh.emissive_texcoord.push_back(emissive);
        mesh.vertex_color.push_back(color);
      }
      return entry->second;
    };
    for (std::uint32_t t = 0; t < mesh.surface_count(); ++t) {
      if (!is_double_sided(t)) continue;
      mesh.back_triangle[t] = static_cast<std::uint32_t>(mesh.triangle.size());
      const auto [a, b, c] = mesh.triangle[t];
      mesh.triangle.push_back({back_of(a), back_of(c), back_of(b)});
      mesh.triangle_material.push_back(mesh.triangle_material[t]);
      sides_.push_back(sides_[t] & kBackSide ? kFrontSide : 0);
    }
  }

  void add_patch_of(std::uint32_t t) {
    if (!(sides_[t] & kFrontSide)) {
      model_.mesh.triangle_patch.push_back(kNone);
      ++model_.unlit_side_count;
      return;
    }
    DisplayMesh& mesh = model_.mesh;
    PatchTable& patches = model_.patches;
    mesh.triangle_patch.push_back(static_cast<std::uint32_t>(patches.size()));
    model_.patch_triangle.push_back(t);

    const auto [a, b, c] = mesh.triangle[t];
    const glm::dvec3 p = to_dvec3(mesh.position[a]), q = to_dvec3(mesh.position[b]),
                     r = to_dvec3(mesh.position[c]);
    const glm::dvec3 cross = glm::cross(q - p, r - p);
    patches.area.push_back(static_cast<float>(0.5 * glm::length(cross)));
    patches.centroid.push_back(to_float3((p + q + r) / 3.0));
    patches.normal.push_back(to_float3(glm::normalize(cross)));

    const Material& material = scene_.materials[mesh.triangle_material[t]];
    Float3 reflectance = mean_base_color(
        scene_, material,
        {mesh.base_color_texcoord[a], mesh.base_color_texcoord[b], mesh.base_color_texcoord[c]},
        {mesh.vertex_color[a], mesh.vertex_color[b], mesh.vertex_color[c]});
    Float3 exitance = mean_emitted_luminance(
        scene_, material,
        {mesh.emissive_texcoord[a], mesh.emissive_texcoord[b], mesh.emissive_texcoord[c]});
    for (float& m : exitance) m *= std::numbers::pi_v<float>;
    if (std::ranges::any_of(reflectance, [](float rho) { return rho > kMaxReflectance; })) {
      ++clamped_count_;
      for (float& rho : reflectance) rho = std::min(rho, kMaxReflectance);
    }
    patches.reflectance.push_back(reflectance);
    patches.emitted_exitance.push_back(exitance);
  }

  Scene scene_;
  std::vector<std::uint8_t> sides_;  ///< of each display triangle
  PatchModel model_;
  std::size_t clamped_count_ = 0;
};

}  // namespace

PatchModel make_patch_model(Scene scene, const SubdivisionSettings& settings) {
  if (scene.triangle.empty()) throw Error("scene " + scene.name + " has no triangles");
  return PatchModelBuilder(std::move(scene), settings).build();
}

}  // namespace rebounce
