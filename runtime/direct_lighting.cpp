#include "rebounce/runtime/direct_lighting.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "rebounce/runtime/float3_glm.h"
#include "rebounce/runtime/light_sampling.h"
#include "rebounce/runtime/sampling.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

constexpr std::size_t kBlock = 64;  // patches that a thread lights at a time

// A shadow ray stops this part of its length before the lamp, which may hang on a surface.
constexpr float kLampGap = 1e-4F;

}  // namespace

DirectLighting::DirectLighting(const TransferData& data, const RayTracer& tracer,
                               const DirectLightingSettings& settings)
    : data_(data), tracer_(tracer), points_per_patch_(settings.points_per_patch) {
  if (settings.points_per_patch < 1) throw Error("direct light needs at least one point per patch");
  const std::size_t n = data.patches.size();
  points_.resize(n * points_per_patch_);
  rays_.resize(n * points_per_patch_);
  contributions_.resize(n * points_per_patch_);
  const PatchTriangles triangles(data.mesh.triangle_patch, n);
#pragma omp parallel for schedule(dynamic, 64)
  for (std::size_t i = 0; i < n; ++i) {
    const std::span points = std::span(points_).subspan(i * points_per_patch_, points_per_patch_);
    spread_points(data.mesh, triangles[i], unit_square(mix_bits(i)), points);
    for (PatchPoint& p : points) p.position = tracer.offset_point(p.position, p.normal);
  }
}

void DirectLighting::compute(std::span<const Light> lights, const Sky& sky,
                             std::span<Float3> direct_irradiance) {
  const std::size_t n = data_.patches.size();
  assert(direct_irradiance.size() == n);
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t begin = 0; begin < n; begin += kBlock) {
    const std::size_t end = std::min(n, begin + kBlock);
    for (std::size_t i = begin; i < end; ++i) {
      // A uniform sky of luminance L gives pi L to a patch that sees nothing else.
      const float e = std::numbers::pi_v<float> * sky.luminance * data_.patches.sky_visibility[i];
      direct_irradiance[i] = {e * sky.color[0], e * sky.color[1], e * sky.color[2]};
    }
    for (const Light& light : lights) add_light(light, begin, end, direct_irradiance);
  }
}

void DirectLighting::add_light(const Light& light, std::size_t begin, std::size_t end,
                               std::span<Float3> direct_irradiance) {
  Ray* const rays = &rays_[begin * points_per_patch_];
  ShadowRay* const contributions = &contributions_[begin * points_per_patch_];
  std::size_t count = 0;
  for (std::size_t k = begin * points_per_patch_; k < end * points_per_patch_; ++k) {
    const std::size_t patch = k / points_per_patch_;
    const auto& [position, normal] = points_[k];
    const IncidentLight incident = evaluate_light(light, position);
    const float cosine = glm::dot(to_glm(incident.direction), to_glm(normal));
    const Float3& e = incident.illuminance;
    if (cosine <= 0 || (e[0] <= 0 && e[1] <= 0 && e[2] <= 0)) continue;
    const float weight = cosine / static_cast<float>(points_per_patch_);
    contributions[count] = {static_cast<std::uint32_t>(patch),
                            {weight * e[0], weight * e[1], weight * e[2]}};
    Ray& ray = rays[count++];
    ray = Ray{};
    ray.origin = position;
    ray.direction = incident.direction;
    ray.t_near = 0;
    ray.t_far = incident.distance * (1 - kLampGap);
  }
  tracer_.occluded({rays, count});
  for (std::size_t k = 0; k < count; ++k) {
    if (is_occluded(rays[k])) continue;
    Float3& e = direct_irradiance[contributions[k].patch];
    for (int c = 0; c < kChannelCount; ++c) e[c] += contributions[k].irradiance[c];
  }
}

}  // namespace rebounce
