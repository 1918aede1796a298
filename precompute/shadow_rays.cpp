#include "shadow_rays.h"

#include <array>

#include "rebounce/runtime/float3_glm.h"
#include "rebounce/runtime/sampling.h"

namespace rebounce {

ShadowRays::ShadowRays(const PatchModel& model, const RayTracer& tracer, std::uint64_t seed,
                       double kernel_tolerance)
    : seed_(seed), kernel_tolerance_(kernel_tolerance) {
  const std::size_t n = model.patch_triangle.size();
  triangles_.reserve(n);
  for (const std::uint32_t t : model.patch_triangle) {
    const Uint3& v = model.mesh.triangle[t];
    triangles_.emplace_back(to_dvec3(model.mesh.position[v[0]]),
                            to_dvec3(model.mesh.position[v[1]]),
                            to_dvec3(model.mesh.position[v[2]]));
  }
  points_.resize(n * kPointCount);
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < n; ++i) {
    const FlatTriangle& t = triangles_[i];
    const glm::dvec2 shift = unit_square(mix_bits(seed ^ mix_bits(i)));
    for (std::uint32_t k = 0; k < kPointCount; ++k) {
      const glm::dvec2 b = square_to_triangle(r2_point(k, shift));
      const glm::dvec3 p =
          t.vertex[0] + b.x * (t.vertex[1] - t.vertex[0]) + b.y * (t.vertex[2] - t.vertex[0]);
      points_[i * kPointCount + k] = tracer.offset_point(to_float3(p), to_float3(t.normal));
    }
  }
}

std::uint64_t ShadowRays::pair_hash(std::uint32_t i, std::uint32_t j) const {
  return mix_bits(seed_ * 0x9E3779B9ULL + ((static_cast<std::uint64_t>(i) << 32) | j));
}

/// The points that ray k of the pair (i, j) joins. Both walk the patches' point sets, the second
/// by steps of 19 from a start of the pair's own, so that every prefix covers all four dimensions.
std::pair<const Float3*, const Float3*> ShadowRays::ray_ends(std::uint32_t i, std::uint32_t j,
                                                             std::uint32_t k,
                                                             std::uint64_t hash) const {
  const std::uint32_t a = (k + static_cast<std::uint32_t>(hash)) % kPointCount;
  const std::uint32_t b = (19 * k + static_cast<std::uint32_t>(hash >> 32)) % kPointCount;
  return {&points_[static_cast<std::size_t>(i) * kPointCount + a],
          &points_[static_cast<std::size_t>(j) * kPointCount + b]};
}

void ShadowRays::make_rays(std::uint32_t i, const std::vector<FacingPatch>& facing, int count,
                           std::vector<Ray>& rays) const {
  rays.resize(facing.size() * count);
  Ray* ray = rays.data();
  for (const FacingPatch& other : facing) {
    const std::uint64_t hash = pair_hash(i, other.patch);
    for (int k = 0; k < count; ++k, ++ray) {
      const auto [x, y] = ray_ends(i, other.patch, k, hash);
      *ray = Ray{};
      ray->origin = *x;
      ray->t_near = 0;
      ray->direction = {(*y)[0] - (*x)[0], (*y)[1] - (*x)[1], (*y)[2] - (*x)[2]};
      ray->t_far = 1;
    }
  }
}

ShadowRays::Visibility ShadowRays::visibility(std::uint32_t i, std::uint32_t j,
                                              std::span<const Ray> rays) const {
  const std::uint64_t hash = pair_hash(i, j);
  std::array<double, kPointCount> weight;
  for (std::size_t k = 0; k < rays.size(); ++k) {
    const auto [x, y] = ray_ends(i, j, static_cast<std::uint32_t>(k), hash);
    weight[k] =
        point_kernel(to_dvec3(*x), triangles_[i].normal, to_dvec3(*y), triangles_[j].normal);
  }
  return visible_part(rays, std::span(weight).first(rays.size()));
}

ShadowRays::Visibility ShadowRays::visible_part(std::span<const Ray> rays,
                                                std::span<const double> weight) {
  double sum = 0, sum_of_squares = 0, visible = 0, count = 0;
  for (std::size_t k = 0; k < rays.size(); ++k) {
    const bool clear = !is_occluded(rays[k]);
    sum += weight[k];
    sum_of_squares += weight[k] * weight[k];
    visible += clear ? weight[k] : 0;
    count += clear ? 1 : 0;
  }
  const double part = sum > 0 ? visible / sum : count / static_cast<double>(rays.size());
  // As sure as that many rays of equal weight (Kish's effective sample size).
  const double effective = sum > 0 ? sum * sum / sum_of_squares : 1;
  const bool mixed = count > 0 && count < static_cast<double>(rays.size());
  return {part, part * (1 - part) / effective, mixed};
}

}  // namespace rebounce
