#include "shadow_rays.h"

#include <array>

#include "rebounce/runtime/float3_glm.h"
#include "rebounce/runtime/sampling.h"

namespace rebounce {

std::uint64_t ShadowRays::pair_hash(std::uint32_t i, std::uint32_t j) const {
  return mix_bits(seed_ * 0x9E3779B9ULL + ((static_cast<std::uint64_t>(i) << 32) | j));
}

/// The points that ray k of the pair (i, j) joins. Both walk the patches' point sets, the second
/// by steps of 19 from a start of the pair's own, so that every prefix covers all four dimensions.
std::pair<const PatchPoint*, const PatchPoint*> ShadowRays::ray_ends(std::uint32_t i,
                                                                     std::uint32_t j,
                                                                     std::uint32_t k,
                                                                     std::uint64_t hash) const {
  const std::uint32_t a = (k + static_cast<std::uint32_t>(hash)) % kPointCount;
  const std::uint32_t b = (19 * k + static_cast<std::uint32_t>(hash >> 32)) % kPointCount;
  return {&geometry_.points(i)[a], &geometry_.points(j)[b]};
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
      ray->origin = x->position;
      ray->t_near = 0;
      ray->direction = to_float3(to_glm(y->position) - to_glm(x->position));
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
    weight[k] = point_kernel(to_dvec3(x->position), to_dvec3(x->normal), to_dvec3(y->position),
                             to_dvec3(y->normal));
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
