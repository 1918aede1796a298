#include "precompute/patches/cut_surface.h"

#include <algorithm>
#include <cmath>

#include "precompute/patches/contact_cuts.h"
#include "precompute/patches/covers.h"
#include "precompute/patches/hemisphere_visibility.h"
#include "precompute/patches/opacity_sampling.h"
#include "precompute/patches/refinement.h"
#include "rebounce/error.h"

namespace rebounce {
namespace {

// The part of the progress after cuts at contacts. Measured on scenes of about 300,000 triangles.
constexpr double kAfterContacts = 0.3;

// The largest number of triangles, per wanted patch, that are added where others are covered in
// part.
constexpr double kMostAtCovers = 4;

// The same where the light of the scene's lamps varies.
constexpr double kMostInLampLight = 8;

class SurfaceCutter {
 public:
  SurfaceCutter(Scene scene, const SubdivisionSettings& settings, const Progress& progress)
      : scene_(std::move(scene)),
        settings_(settings),
        progress_(progress),
        lamp_light_(scene_, settings.lamp_weight) {}

  CutSurface cut() {
    const std::size_t sliver_count = drop_slivers();
    const std::size_t original_count = scene_.triangle.size();
    cut_at_contacts(scene_, settings_);
    drop_thin(0);
    report_progress(progress_, kAfterContacts);
    const OpacityMaps opacity = find_opacity_maps(scene_);
    const RayTracer tracer(scene_.position, scene_.triangle, opacity);
    sides_ = find_lit_sides(scene_, tracer, part_of(progress_, kAfterContacts, 1));
    for (std::uint32_t t = 0; t < sides_.size(); ++t) {
      if (opacity.stopping_part(t) == 0) sides_[t] = {SideKind::kOpening, SideKind::kOpening};
    }
    // Without patches to count, cuts would go on for ever.
    if (!is_lit()) refuse_unlit_scene(scene_);
    const double scene_size = mean_patch_size(scene_, patches_per_triangle(), 1);
    inherit_sides(subdivide(scene_, patches_per_triangle(), settings_, density_weights(tracer)));
    if (!lamp_light_.empty()) lamp_light_.measure(scene_, sides_, tracer);
    refine(tracer, scene_size);
    drop_thin(0);  // cuts leave triangles without area at the precision of floats
    return {std::move(scene_), std::move(sides_), std::move(lamp_light_), sliver_count,
            original_count};
  }

 private:
  bool is_lit() const {
    return std::ranges::any_of(sides_, [](const TriangleSides& s) { return s.patch_count() > 0; });
  }

  std::vector<std::uint8_t> patches_per_triangle() const {
    std::vector<std::uint8_t> count;
    count.reserve(sides_.size());
    for (const TriangleSides& s : sides_) {
      count.push_back(static_cast<std::uint8_t>(s.patch_count()));
    }
    return count;
  }

  /// Makes triangles small relative to patches where they are covered in part or lit unevenly;
  /// `scene_size` is the square root of the area of all lit sides, metres.
  void refine(const RayTracer& tracer, double scene_size) {
    const double patch_size =
        settings_.patch_count > 0
            ? scene_size / std::sqrt(static_cast<double>(settings_.patch_count))
            : settings_.patch_size / kLongestEdge;
    if (!(patch_size > 0)) return;
    const double wanted = std::pow(scene_size / patch_size, 2);
    inherit_sides(refine_at_covers(scene_, sides_, tracer, patch_size,
                                   static_cast<std::size_t>(kMostAtCovers * wanted)));
    if (lamp_light_.empty()) return;
    inherit_sides(lamp_light_.refine(scene_, sides_, tracer, patch_size,
                                     static_cast<std::size_t>(kMostInLampLight * wanted)));
  }

  /// The density weight of each triangle: the larger one of its lit sides. Empty if patches have a
  /// given size.
  std::vector<float> density_weights(const RayTracer& tracer) const {
    if (settings_.patch_size > 0) return {};
    const double mean_area =
        std::pow(mean_patch_size(scene_, patches_per_triangle(), settings_.patch_count), 2);
    std::vector<float> result(sides_.size(), 1.0F);
#pragma omp parallel for schedule(dynamic, 256)
    for (std::uint32_t t = 0; t < sides_.size(); ++t) {
      const auto [p, q, r] = corners_of(scene_, t);
      const TriangleCorners front{p, q, r}, back{p, r, q};
      if (area_of(front) <= kSmallElement * mean_area) continue;
      const auto of = [&](const TriangleCorners& side) {
        return static_cast<float>(
            density_weight(hemisphere_visibility(side, tracer, kSightRays, t)));
      };
      float most = 0;
      if (sides_[t].front == SideKind::kLit) most = of(front);
      if (sides_[t].back == SideKind::kLit && most < 1) most = std::max(most, of(back));
      if (most > 0) result[t] = most;
    }
    return result;
  }

  /// Gives the parts of triangles their sides; `source` [t] is the triangle that each was part of.
  void inherit_sides(const std::vector<std::uint32_t>& source) {
    std::vector<TriangleSides> sides;
    sides.reserve(source.size());
    for (const std::uint32_t t : source) sides.push_back(sides_[t]);
    sides_ = std::move(sides);
  }

  /// Removes triangles whose height is below the precision of rays: what stands on them or sees
  /// them cannot be determined. Returns their number.
  std::size_t drop_slivers() {
    const std::size_t dropped = drop_thin(ray_offset_distance(scene_.position));
    if (scene_.triangle.empty())
      throw Error("scene " + scene_.name + " has no triangles but slivers; check --scale");
    return dropped;
  }

  /// Removes triangles no higher than `thinnest` metres, and their sides if these are known.
  /// Returns their number.
  std::size_t drop_thin(double thinnest) {
    std::size_t kept = 0;
    for (std::size_t t = 0; t < scene_.triangle.size(); ++t) {
      const TriangleCorners corners = corners_of(scene_, t);
      if (2 * area_of(corners) <= thinnest * longest_edge_length(corners)) continue;
      scene_.triangle[kept] = scene_.triangle[t];
      if (!scene_.triangle_mesh.empty()) scene_.triangle_mesh[kept] = scene_.triangle_mesh[t];
      if (!sides_.empty()) sides_[kept] = sides_[t];
      scene_.triangle_material[kept++] = scene_.triangle_material[t];
    }
    const std::size_t dropped = scene_.triangle.size() - kept;
    scene_.triangle.resize(kept);
    scene_.triangle_material.resize(kept);
    if (!scene_.triangle_mesh.empty()) scene_.triangle_mesh.resize(kept);
    if (!sides_.empty()) sides_.resize(kept);
    return dropped;
  }

  Scene scene_;
  const SubdivisionSettings& settings_;
  const Progress& progress_;
  std::vector<TriangleSides> sides_;  ///< of each triangle, once they are known
  LampLight lamp_light_;
};

}  // namespace

CutSurface cut_surface(Scene scene, const SubdivisionSettings& settings, const Progress& progress) {
  return SurfaceCutter(std::move(scene), settings, progress).cut();
}

void refuse_unlit_scene(const Scene& scene) {
  throw Error("scene " + scene.name + " has no surface that light can reach");
}

}  // namespace rebounce
