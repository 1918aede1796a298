#include "precompute/patches/patch_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "precompute/patches/covers.h"
#include "precompute/patches/cut_surface.h"
#include "precompute/patches/element_clusters.h"
#include "precompute/patches/hemisphere_visibility.h"
#include "precompute/patches/opacity_sampling.h"
#include "precompute/patches/texture_sampling.h"
#include "precompute/patches/vertex_split.h"
#include "precompute/patches/welded_positions.h"
#include "rebounce/error.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

// The progress after each step. Measured on scenes of about 300,000 triangles.
constexpr double kAfterCuts = 0.25, kAfterElements = 0.33, kAfterClusters = 0.92;

// Covered surfaces count by this fraction less in the distribution of patches: they are dark, and
// their light comes from nearby.
constexpr double kLessCovered = 0.75;

// Points of an element above kSmallElement at which covers are searched; others get one.
constexpr std::uint32_t kCoverPoints = 8;

// Points of an element, and of a small one, at which the light of the scene's lamps is found.
constexpr std::uint32_t kLampPoints = 8, kLampPointsOfSmall = 2;

class PatchModelBuilder {
 public:
  PatchModelBuilder(CutSurface surface, const SubdivisionSettings& settings,
                    const Progress& progress)
      : scene_(std::move(surface.scene)),
        settings_(settings),
        progress_(progress),
        sides_(std::move(surface.sides)),
        lamp_light_(std::move(surface.lamp_light)) {
    model_.sliver_count = surface.sliver_count;
    model_.scene_triangle_count = surface.original_triangle_count;
  }

  PatchModel build() {
    move_surface();
    add_second_sides();
    find_openings();
    const RayTracer tracer = make_surface_tracer(model_.mesh);
    make_patches(tracer);
    find_shown_patches(tracer);
    report_progress(progress_, kAfterClusters);
    copy_lightmap_texcoords(split_vertices(model_.shown_patch, tracer,
                                           kCloseCover * std::sqrt(patch_area_), model_.mesh));
    if (clamped_count_ > 0) {
      model_.warnings.push_back("the reflectance of " + std::to_string(clamped_count_) +
                                " patches was clamped to 0.99");
    }
    return std::move(model_);
  }

 private:
  bool is_double_sided(std::uint32_t t) const {
    return scene_.materials[model_.mesh.triangle_material[t]].double_sided;
  }

  /// Moves the surface out of the scene; only its materials are left there.
  void move_surface() {
    DisplayMesh& mesh = model_.mesh;
    mesh.position = std::move(scene_.position);
    mesh.normal = std::move(scene_.normal);
    mesh.base_color_texcoord = std::move(scene_.base_color_texcoord);
    mesh.emissive_texcoord = std::move(scene_.emissive_texcoord);
    mesh.vertex_color = std::move(scene_.vertex_color);
    model_.lightmap_texcoord = std::move(scene_.lightmap_texcoord);
    model_.lightmap_page = scene_.lightmap_page;
    mesh.triangle = std::move(scene_.triangle);
    mesh.triangle_material = std::move(scene_.triangle_material);
    model_.triangle_mesh = std::move(scene_.triangle_mesh);
    mesh.back_triangle.assign(mesh.triangle.size(), kNone);
    for (const TriangleSides& sides : sides_) kind_.push_back(sides.front);
    surface_of_.resize(mesh.triangle.size());
    std::iota(surface_of_.begin(), surface_of_.end(), 0U);
  }

  /// For vertices that were appended as copies.
  void copy_lightmap_texcoords(std::span<const std::uint32_t> copied) {
    if (model_.lightmap_texcoord.empty()) return;
    for (const std::uint32_t v : copied) {
      model_.lightmap_texcoord.push_back(model_.lightmap_texcoord[v]);
    }
  }

  /// Appends a copy with reversed winding and normals of every double-sided triangle.
  void add_second_sides() {
    DisplayMesh& mesh = model_.mesh;
    std::vector<std::uint32_t> back_vertex(mesh.position.size(), kNone);
    const auto back_of = [&](std::uint32_t v) {
      if (back_vertex[v] == kNone) {
        back_vertex[v] = copy_vertex(mesh, v);
        for (float& n : mesh.normal[back_vertex[v]]) n = -n;
        if (!model_.lightmap_texcoord.empty()) {
          model_.lightmap_texcoord.push_back(model_.lightmap_texcoord[v]);
        }
      }
      return back_vertex[v];
    };
    for (std::uint32_t t = 0; t < mesh.surface_count(); ++t) {
      if (!is_double_sided(t)) continue;
      mesh.back_triangle[t] = static_cast<std::uint32_t>(mesh.triangle.size());
      const auto [a, b, c] = mesh.triangle[t];
      mesh.triangle.push_back({back_of(a), back_of(c), back_of(b)});
      mesh.triangle_material.push_back(mesh.triangle_material[t]);
      if (!model_.triangle_mesh.empty()) {
        model_.triangle_mesh.push_back(model_.triangle_mesh[t]);
      }
      kind_.push_back(sides_[t].back);
      surface_of_.push_back(t);
    }
  }

  /// Finds the openings, after the triangles are cut.
  void find_openings() {
    DisplayMesh& mesh = model_.mesh;
    mesh.opacity =
        find_opacity_maps(scene_, mesh.triangle, mesh.triangle_material, mesh.base_color_texcoord);
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
      if (mesh.opacity.stopping_part(t) == 0) kind_[t] = SideKind::kOpening;
    }
  }

  TriangleCorners corners(std::uint32_t t) const { return corners_of(model_.mesh, t); }

  /// Texture samples of a display triangle: the triangles of a patch share its samples.
  int sample_count(std::uint32_t t) const {
    const double part = area_of(corners(t)) / patch_area_;
    return static_cast<int>(
        std::min(std::ceil(part * kMostTextureSamples), 1.0 * kMostTextureSamples));
  }

  /// Mean reflectance of a display triangle, textures integrated.
  Float3 mean_reflectance(std::uint32_t t) const {
    const DisplayMesh& mesh = model_.mesh;
    const auto [a, b, c] = mesh.triangle[t];
    return mean_base_color(
        scene_, scene_.materials[mesh.triangle_material[t]],
        {mesh.base_color_texcoord[a], mesh.base_color_texcoord[b], mesh.base_color_texcoord[c]},
        {mesh.vertex_color[a], mesh.vertex_color[b], mesh.vertex_color[c]}, sample_count(t));
  }

  /// Mean emitted exitance of a display triangle in lx, textures integrated.
  Float3 mean_exitance(std::uint32_t t) const {
    const DisplayMesh& mesh = model_.mesh;
    const auto [a, b, c] = mesh.triangle[t];
    Float3 exitance = mean_emitted_luminance(
        scene_, scene_.materials[mesh.triangle_material[t]],
        {mesh.emissive_texcoord[a], mesh.emissive_texcoord[b], mesh.emissive_texcoord[c]},
        {mesh.base_color_texcoord[a], mesh.base_color_texcoord[b], mesh.base_color_texcoord[c]},
        sample_count(t));
    for (float& m : exitance) m *= std::numbers::pi_v<float>;
    return exitance;
  }

  /// The mean area of a patch if there are as many as wanted, m².
  double mean_patch_area() const {
    if (settings_.patch_count == 0) return std::pow(static_cast<double>(settings_.patch_size), 2);
    double area = 0;
    for (const std::uint32_t t : element_triangle_) area += area_of(corners(t));
    return area / static_cast<double>(settings_.patch_count);
  }

  /// The number of the position of each vertex, among the positions of the elements.
  std::vector<std::uint32_t> weld_elements() {
    WeldedPositions welded = weld_positions(model_.mesh.position);
    elements_.position.resize(welded.count);
    for (std::size_t v = 0; v < welded.id.size(); ++v) {
      elements_.position[welded.id[v]] = model_.mesh.position[v];
    }
    return std::move(welded.id);
  }

  /// Makes the elements from the lit sides, with reflectance, emission and cover.
  void make_elements(const RayTracer& tracer) {
    for (std::uint32_t t = 0; t < kind_.size(); ++t) {
      if (kind_[t] == SideKind::kLit) element_triangle_.push_back(t);
    }
    const std::vector<std::uint32_t> position = weld_elements();
    const std::size_t count = element_triangle_.size();
    if (count == 0) refuse_unlit_scene(scene_);
    elements_.resize(count);
    patch_area_ = mean_patch_area();
#pragma omp parallel for schedule(dynamic, 256)
    for (std::size_t e = 0; e < count; ++e) {
      const std::uint32_t t = element_triangle_[e];
      const TriangleCorners corner = corners(t);
      const glm::dvec3 area = area_vector(corner);
      const auto [a, b, c] = model_.mesh.triangle[t];
      elements_.triangle[e] = surface_of_[t];
      elements_.corner[e] = {position[a], position[b], position[c]};
      elements_.normal[e] = to_float3(glm::normalize(area));
      elements_.area[e] =
          static_cast<float>(glm::length(area) * model_.mesh.opacity.stopping_part(t));
      elements_.reflectance[e] = mean_reflectance(t);
      const bool small = elements_.area[e] <= kSmallElement * patch_area_;
      elements_.covered[e] = static_cast<float>(covered_part(
          corner, tracer, kCoverHeight * std::sqrt(patch_area_), small ? 1 : kCoverPoints));
      if (settings_.patch_size == 0) {
        const double seen =
            small ? 1 : density_weight(hemisphere_visibility(corner, tracer, kSightRays, e));
        elements_.density_weight[e] =
            static_cast<float>(seen * (1 - kLessCovered * elements_.covered[e]));
      }
      elements_.lamp_light[e] = static_cast<float>(
          lamp_light_.feature(corner, tracer, small ? kLampPointsOfSmall : kLampPoints));
      elements_.emits[e] =
          std::ranges::any_of(mean_exitance(t), [](float m) { return m > 0; }) ? 1 : 0;
    }
  }

  void make_patches(const RayTracer& tracer) {
    make_elements(tracer);
    report_progress(progress_, kAfterElements);
    const ElementPatches merged = merge_elements(
        elements_, tracer, {.patch_count = settings_.patch_count, .largest = settings_.patch_size},
        part_of(progress_, kAfterElements, kAfterClusters));
    model_.element_count = elements_.size();
    model_.mesh.triangle_patch.assign(model_.mesh.triangle.size(), kNone);
    for (std::size_t e = 0; e < elements_.size(); ++e) {
      model_.mesh.triangle_patch[element_triangle_[e]] = merged.patch[e];
    }
    average_elements(merged);
  }

  /// Fills the table of patches with the area-weighted means of their elements.
  void average_elements(const ElementPatches& merged) {
    const std::size_t n = merged.patch_count;
    std::vector<double> area(n, 0.0);
    std::vector<glm::dvec3> centroid(n, glm::dvec3(0)), normal = centroid, reflectance = centroid,
                                                        exitance = centroid;
    std::vector<Float3> first_normal(n);
    for (std::size_t e = merged.patch.size(); e-- > 0;) {
      const std::uint32_t i = merged.patch[e];
      const double part = elements_.area[e];
      area[i] += part;
      centroid[i] += part * to_dvec3(elements_.centroid(e));
      normal[i] += part * to_dvec3(elements_.normal[e]);
      reflectance[i] += part * to_dvec3(elements_.reflectance[e]);
      if (elements_.emits[e] != 0) {
        exitance[i] += part * to_dvec3(mean_exitance(element_triangle_[e]));
      }
      first_normal[i] = elements_.normal[e];
    }
    PatchTable& patches = model_.patches;
    for (std::size_t i = 0; i < n; ++i) {
      patches.area.push_back(static_cast<float>(area[i]));
      patches.centroid.push_back(to_float3(centroid[i] / area[i]));
      const double length = glm::length(normal[i]);
      // A closed patch has no mean normal.
      patches.normal.push_back(length > 1e-6 * area[i] ? to_float3(normal[i] / length)
                                                       : first_normal[i]);
      patches.reflectance.push_back(clamp_reflectance(to_float3(reflectance[i] / area[i])));
      patches.emitted_exitance.push_back(to_float3(exitance[i] / area[i]));
    }
  }

  Float3 clamp_reflectance(Float3 reflectance) {
    if (std::ranges::any_of(reflectance, [](float rho) { return rho > kMaxReflectance; })) {
      ++clamped_count_;
      for (float& rho : reflectance) rho = std::min(rho, kMaxReflectance);
    }
    return reflectance;
  }

  /// Covered sides show the light of the surface that covers them at their middle.
  void find_shown_patches(const RayTracer& tracer) {
    const DisplayMesh& mesh = model_.mesh;
    model_.shown_patch = mesh.triangle_patch;
    std::vector<Hit> hits;
    std::vector<CoincidentSide> sides;
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
      model_.unlit_side_count += kind_[t] == SideKind::kUnlit ? 1 : 0;
      model_.opening_side_count += kind_[t] == SideKind::kOpening ? 1 : 0;
      model_.buried_side_count += kind_[t] == SideKind::kBuried ? 1 : 0;
      if (kind_[t] != SideKind::kCovered) continue;
      ++model_.covered_side_count;
      const TriangleCorners p = corners(t);
      find_coincident_sides(
          tracer, to_float3((p[0] + p[1] + p[2]) / 3.0), to_float3(front_normal(p)), surface_of_[t],
          [&](std::uint32_t o) { return mesh.back_triangle[o] != kNone; }, hits, sides);
      for (const CoincidentSide& side : sides) {
        const std::uint32_t other = side.front ? side.triangle : mesh.back_triangle[side.triangle];
        if (!side.same_way || mesh.triangle_patch[other] == kNone) continue;
        model_.shown_patch[t] = std::min(model_.shown_patch[t], mesh.triangle_patch[other]);
      }
    }
  }

  Scene scene_;
  const SubdivisionSettings& settings_;
  const Progress& progress_;
  std::vector<TriangleSides> sides_;  ///< of each triangle of the cut scene
  LampLight lamp_light_;
  std::vector<SideKind> kind_;                   ///< of each display triangle
  std::vector<std::uint32_t> surface_of_;        ///< surface triangle of each display triangle
  std::vector<std::uint32_t> element_triangle_;  ///< display triangle of each element
  Elements elements_;
  double patch_area_ = 0;  ///< of the mean patch, m²
  PatchModel model_;
  std::size_t clamped_count_ = 0;
};

}  // namespace

PatchModel make_patch_model(Scene scene, const SubdivisionSettings& settings,
                            const Progress& progress) {
  if (scene.triangle.empty()) throw Error("scene " + scene.name + " has no triangles");
  CutSurface surface = cut_surface(std::move(scene), settings, part_of(progress, 0, kAfterCuts));
  return PatchModelBuilder(std::move(surface), settings, progress).build();
}

}  // namespace rebounce
