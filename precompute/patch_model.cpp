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
    drop_slivers();
    model_.scene_triangle_count = scene_.triangle.size();
    const std::vector<TriangleSides> sides =
        find_lit_sides(scene_, RayTracer(scene_.position, scene_.triangle));
    std::vector<std::uint8_t> patches_per_triangle;
    patches_per_triangle.reserve(sides.size());
    for (const TriangleSides& s : sides) {
      patches_per_triangle.push_back(static_cast<std::uint8_t>(s.patch_count()));
    }
    const std::vector<std::uint32_t> source = subdivide(scene_, patches_per_triangle, settings);
    sides_.reserve(source.size());
    for (const std::uint32_t t : source) sides_.push_back(sides[t]);
  }

  PatchModel build() {
    copy_surface();
    add_second_sides();
    for (std::uint32_t t = 0; t < model_.mesh.triangle.size(); ++t) {
      model_.mesh.triangle_patch.push_back(kNone);
      if (kind_[t] == SideKind::kLit) add_patch_of(t);
    }
    find_shown_patches();
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
    for (const TriangleSides& sides : sides_) kind_.push_back(sides.front);
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
      kind_.push_back(sides_[t].back);
    }
  }

  void add_patch_of(std::uint32_t t) {
    DisplayMesh& mesh = model_.mesh;
    PatchTable& patches = model_.patches;
    mesh.triangle_patch[t] = static_cast<std::uint32_t>(patches.size());

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

  /// Takes out triangles whose height is below the precision of rays: what stands on them or looks
  /// at them cannot be told.
  void drop_slivers() {
    const float thinnest = RayTracer(scene_.position, scene_.triangle).offset_distance();
    std::size_t kept = 0;
    for (std::size_t t = 0; t < scene_.triangle.size(); ++t) {
      const auto [a, b, c] = scene_.triangle[t];
      const glm::dvec3 p = to_dvec3(scene_.position[a]), q = to_dvec3(scene_.position[b]),
                       r = to_dvec3(scene_.position[c]);
      const double longest =
          std::max({glm::distance(p, q), glm::distance(q, r), glm::distance(r, p)});
      if (glm::length(glm::cross(q - p, r - p)) < thinnest * longest) continue;
      scene_.triangle[kept] = scene_.triangle[t];
      scene_.triangle_material[kept++] = scene_.triangle_material[t];
    }
    model_.sliver_count = scene_.triangle.size() - kept;
    if (kept == 0) throw Error("scene " + scene_.name + " has nothing but slivers");
    scene_.triangle.resize(kept);
    scene_.triangle_material.resize(kept);
  }

  /// Covered sides show the light of what covers them at their middle.
  void find_shown_patches() {
    const DisplayMesh& mesh = model_.mesh;
    model_.shown_patch = mesh.triangle_patch;
    const RayTracer tracer(mesh.position, std::span(mesh.triangle).first(mesh.surface_count()));
    std::vector<std::uint32_t> surface_of(mesh.triangle.size());
    for (std::uint32_t t = 0; t < mesh.surface_count(); ++t) {
      surface_of[t] = t;
      if (mesh.back_triangle[t] != kNone) surface_of[mesh.back_triangle[t]] = t;
    }
    std::vector<Hit> hits;
    std::vector<CoincidentSide> sides;
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
      model_.unlit_side_count += kind_[t] == SideKind::kUnlit ? 1 : 0;
      if (kind_[t] != SideKind::kCovered) continue;
      ++model_.covered_side_count;
      const auto [a, b, c] = mesh.triangle[t];
      const glm::dvec3 p = to_dvec3(mesh.position[a]), q = to_dvec3(mesh.position[b]),
                       r = to_dvec3(mesh.position[c]);
      find_coincident_sides(
          tracer, to_float3((p + q + r) / 3.0), to_float3(glm::normalize(glm::cross(q - p, r - p))),
          surface_of[t], [&](std::uint32_t o) { return mesh.back_triangle[o] != kNone; }, hits,
          sides);
      for (const CoincidentSide& side : sides) {
        const std::uint32_t other = side.front ? side.triangle : mesh.back_triangle[side.triangle];
        if (!side.same_way || mesh.triangle_patch[other] == kNone) continue;
        model_.shown_patch[t] = std::min(model_.shown_patch[t], mesh.triangle_patch[other]);
      }
    }
  }

  Scene scene_;
  std::vector<TriangleSides> sides_;  ///< of each triangle of the subdivided scene
  std::vector<SideKind> kind_;        ///< of each display triangle
  PatchModel model_;
  std::size_t clamped_count_ = 0;
};

}  // namespace

PatchModel make_patch_model(Scene scene, const SubdivisionSettings& settings) {
  if (scene.triangle.empty()) throw Error("scene " + scene.name + " has no triangles");
  return PatchModelBuilder(std::move(scene), settings).build();
}

}  // namespace rebounce
