#include "link_rays.h"

#include <algorithm>
#include <array>

#include "rebounce/runtime/float3_glm.h"
#include "rebounce/runtime/sampling.h"

namespace rebounce {
namespace {

constexpr std::uint32_t kPoints = ShadowRays::kPointCount;

}  // namespace

ShadowRays::Visibility LinkRays::trace(std::uint32_t a, std::uint32_t b, int count,
                                       Scratch& scratch) const {
  if (!tree_[a].is_leaf() || !tree_[b].is_leaf()) return trace_nodes(a, b, count, scratch);
  const std::uint32_t i = tree_.leaf_patch(tree_[a]), j = tree_.leaf_patch(tree_[b]);
  return trace_patches(std::min(i, j), std::max(i, j), count, scratch);
}

ShadowRays::Visibility LinkRays::trace_patches(std::uint32_t i, std::uint32_t j, int count,
                                               Scratch& scratch) const {
  scratch.facing.assign(1, {j, 0});
  shadow_rays_.make_rays(i, scratch.facing, count, scratch.rays);
  tracer_.occluded(scratch.rays);
  return shadow_rays_.visibility(i, j, scratch.rays);
}

ShadowRays::Visibility LinkRays::trace_nodes(std::uint32_t a, std::uint32_t b, int count,
                                             Scratch& scratch) const {
  const std::uint64_t hash =
      mix_bits(seed_ * 0x9E3779B9ULL + ((static_cast<std::uint64_t>(a) << 32) | b));
  const glm::dvec2 shift = unit_square(mix_bits(hash));
  const auto first = static_cast<std::uint32_t>(hash % kPoints);
  scratch.rays.resize(count);
  std::array<double, kMostRays> weight;
  for (int k = 0; k < count; ++k) {
    // Strata of equal area of one node against those of the other, in steps of 19.
    const int other = (19 * k + static_cast<int>(first)) % count;
    const std::uint32_t i = tree_.patch_at(tree_[a], (k + shift.x) / count),
                        j = tree_.patch_at(tree_[b], (other + shift.y) / count);
    const PatchPoint &x = shadow_rays_.geometry().points(i)[(first + k) % kPoints],
                     &y = shadow_rays_.geometry().points(j)[(first + 7 * k) % kPoints];
    Ray& ray = scratch.rays[k];
    ray = Ray{};
    ray.origin = x.position;
    ray.t_near = 0;
    ray.direction = to_float3(to_glm(y.position) - to_glm(x.position));
    ray.t_far = 1;
    weight[k] = point_kernel(to_dvec3(x.position), to_dvec3(x.normal), to_dvec3(y.position),
                             to_dvec3(y.normal));
  }
  tracer_.occluded(scratch.rays);
  return ShadowRays::visible_part(scratch.rays, std::span(weight).first(count));
}

}  // namespace rebounce
