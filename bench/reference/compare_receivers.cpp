#include "bench/reference/compare_receivers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>

#include "bench/reference/error_sum.h"
#include "bench/reference/mesh_value.h"
#include "precompute/outputs/sensor_view.h"
#include "precompute/patches/hit_patch.h"
#include "precompute/sampling/hemisphere_rays.h"
#include "rebounce/error.h"
#include "runtime/frame/direct_lighting.h"
#include "runtime/lights/light_sampling.h"
#include "runtime/lights/sky_light.h"
#include "runtime/outputs/vertex_light.h"
#include "runtime/rays/triangle.h"
#include "transfer/base/reflection.h"

namespace rebounce::reference {
namespace {

// Rays from a point, of which the noise is far below what is looked for.
constexpr std::size_t kPointRays = 1024;

constexpr int kDirectPointsOfRows = 64;  // of a patch
constexpr int kLampPlaces = 4;           // of a lamp with a surface, from where a ray ends

/// The light of the patches, and as it is shown on the display mesh.
struct PatchLight {
  std::vector<Float3> radiosity;       ///< [n] lx
  std::vector<Float3> own;             ///< [n] lx, what a patch sends of emission and sky
  std::vector<Float3> from_lamps;      ///< [n] lx, irradiance
  std::vector<Float3> shown_indirect;  ///< [v] lx
};

PatchLight light_of_patches(const PatchSolution& solution) {
  const TransferData& data = solution.data;
  const PatchTable& table = data.patches;
  const std::size_t n = table.size();
  PatchLight light;
  light.from_lamps.resize(n);
  DirectLighting(data, solution.mesh_tracer, {.points_per_patch = kDirectPointsOfRows})
      .compute(solution.lights, {}, light.from_lamps);
  std::vector<Float3> from_sky(n),
      all(solution.indirect_irradiance.begin(), solution.indirect_irradiance.end());
  for (std::size_t i = 0; i < n; ++i) {
    from_sky[i] = sky_irradiance(data, solution.sky, i);
    for (int c = 0; c < kChannelCount; ++c) all[i][c] += from_sky[i][c] + light.from_lamps[i][c];
  }
  light.own.resize(n);
  light.radiosity.resize(n);
  add_reflected(table.emitted_exitance, table.reflectance, from_sky, light.own);
  add_reflected(table.emitted_exitance, table.reflectance, all, light.radiosity);
  light.shown_indirect.resize(data.mesh.position.size());
  light_at_vertices(data.mesh, solution.indirect_irradiance, light.shown_indirect);
  return light;
}

/// Where a ray ends: a place of a patch.
struct SeenPlace {
  std::uint32_t patch, triangle;
  glm::dvec3 position;
};

/// The rays of one place after the other.
class PlaceViewer {
 public:
  explicit PlaceViewer(const PatchSolution& solution)
      : mesh_(solution.data.mesh), tracer_(solution.mesh_tracer) {}

  /// What cosine-distributed rays from `from`, one each, meet of patches.
  std::span<const SeenPlace> look(std::span<const PatchPoint> from, const glm::dvec2& shift) {
    rays_.resize(from.size());
    hits_.resize(from.size());
    make_hemisphere_rays(from, tracer_, shift, rays_);
    tracer_.intersect(rays_, hits_);
    seen_.clear();
    for (std::size_t k = 0; k < rays_.size(); ++k) {
      prefer_lit_side(mesh_, tracer_, rays_[k], hits_[k], scratch_);
      const Hit& hit = hits_[k];
      const std::uint32_t patch = patch_at(mesh_, mesh_.triangle_patch, hit);
      if (patch == kNone) continue;
      const std::uint32_t side = hit.front ? hit.triangle : mesh_.back_triangle[hit.triangle];
      seen_.push_back({patch, side, point_at(corners_of(mesh_, hit.triangle), {hit.u, hit.v})});
    }
    return seen_;
  }

 private:
  const DisplayMesh& mesh_;
  const RayTracer& tracer_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
  std::vector<SeenPlace> seen_;
  CoincidenceScratch scratch_;
};

/// What the rays of a point bring it in the four ways.
struct PointLight {
  Float3 rows, smooth_light, exact_lamps, exact_both;
};

class PointGathering {
 public:
  PointGathering(const PatchSolution& solution, const PatchLight& light)
      : mesh_(solution.data.mesh),
        reflectance_(solution.data.patches.reflectance),
        indirect_(solution.indirect_irradiance),
        tracer_(solution.mesh_tracer),
        light_(light),
        lights_(solution.lights),
        viewer_(solution) {}

  PointLight gather_at(const SurfacePoint& point, const glm::dvec2& shift) {
    from_.assign(kPointRays, {point.position, point.normal});
    const std::span<const SeenPlace> seen = viewer_.look(from_, shift);
    look_at_lamps(seen);
    glm::dvec3 rows(0), smooth(0), exact(0), both(0);
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const std::uint32_t i = seen[k].patch;
      const glm::dvec3 own = to_dvec3(light_.own[i]), rho = to_dvec3(reflectance_[i]);
      const glm::dvec3 even = to_dvec3(indirect_[i]), lamps = to_dvec3(light_.from_lamps[i]);
      const glm::dvec3 shown =
          interpolated(mesh_, light_.shown_indirect, seen[k].triangle, seen[k].position);
      const glm::dvec3 lamps_there = to_dvec3(lamps_there_[k]);
      rows += to_dvec3(light_.radiosity[i]);
      smooth += own + rho * (lamps + shown);
      exact += own + rho * (lamps_there + even);
      both += own + rho * (lamps_there + shown);
    }
    constexpr double kRays = kPointRays;
    return {to_float3(rows / kRays), to_float3(smooth / kRays), to_float3(exact / kRays),
            to_float3(both / kRays)};
  }

 private:
  void look_at_lamps(std::span<const SeenPlace> seen) {
    position_.clear();
    normal_.clear();
    for (const SeenPlace& place : seen) {
      position_.push_back(to_float3(place.position));
      normal_.push_back(to_float3(front_normal(corners_of(mesh_, place.triangle))));
    }
    lamps_there_.assign(seen.size(), Float3{0, 0, 0});
    for (const Light& lamp : lights_) {
      add_direct_irradiance(tracer_, lamp, position_, normal_, kLampPlaces, lamps_there_);
    }
  }

  const DisplayMesh& mesh_;
  std::span<const Float3> reflectance_, indirect_;
  const RayTracer& tracer_;
  const PatchLight& light_;
  std::span<const Light> lights_;
  PlaceViewer viewer_;
  std::vector<PatchPoint> from_;
  std::vector<Float3> position_, normal_, lamps_there_;
};

}  // namespace

ReceiverErrors compare_receivers(const PatchSolution& solution,
                                 const ReconstructionComparison& shown,
                                 std::span<const SurfacePoint> points,
                                 const IrradianceEstimate& truth, std::uint64_t seed) {
  if (truth.mean.size() != points.size() ||
      solution.indirect_irradiance.size() != solution.data.patches.size()) {
    throw Error("comparison of receivers: one entry per patch and point is needed");
  }
  for (const Light& lamp : solution.lights) check_light(lamp);
  const DisplayMesh& mesh = solution.data.mesh;
  const PatchLight light = light_of_patches(solution);
  std::vector<PointLight> gathered(shown.point.size());
#pragma omp parallel
  {
    PointGathering gathering(solution, light);
#pragma omp for schedule(dynamic, 4)
    for (std::size_t k = 0; k < gathered.size(); ++k) {
      gathered[k] = gathering.gather_at(points[shown.point[k]],
                                        unit_square(mix_bits(seed ^ mix_bits(shown.point[k]))));
    }
  }
  std::array<ErrorSum, 5> sum;
  for (std::size_t k = 0; k < gathered.size(); ++k) {
    const std::uint32_t p = shown.point[k], t = shown.triangle[k];
    const std::uint32_t patch = mesh.triangle_patch[t];
    const Float3 of_patch = patch == kNone ? Float3{0, 0, 0} : solution.indirect_irradiance[patch];
    const auto& [rows, smooth, exact, both] = gathered[k];
    const std::array<Float3, 5> value{of_patch, rows, smooth, exact, both};
    for (std::size_t way = 0; way < value.size(); ++way) {
      sum[way].add(1, value[way], truth.mean[p], truth.standard_error[p]);
    }
  }
  const std::size_t left_out = points.size() - shown.point.size();
  return {sum[0].result(left_out), sum[1].result(left_out), sum[2].result(left_out),
          sum[3].result(left_out), sum[4].result(left_out)};
}

}  // namespace rebounce::reference
