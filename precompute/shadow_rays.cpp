#include "shadow_rays.h"

#include "rebounce/runtime/sampling.h"

namespace rebounce {

std::uint64_t ShadowRays::pair_hash(std::uint32_t i, std::uint32_t j) const {
  return mix_bits(seed_ * 0x9E3779B9ULL + ((static_cast<std::uint64_t>(i) << 32) | j));
}

void ShadowRays::make_rays(std::uint32_t i, const std::vector<FacingPatch>& facing, int count,
                           std::vector<Ray>& rays) const {
  rays.resize(facing.size() * count);
  for (std::size_t p = 0; p < facing.size(); ++p) {
    make_pair_rays(i, facing[p].patch, std::span(rays).subspan(p * count, count));
  }
}

void ShadowRays::make_probe_rays(std::uint32_t i, const std::vector<FacingPatch>& facing, int count,
                                 std::vector<Ray>& rays) const {
  rays.resize(facing.size() * count);
  for (std::size_t p = 0; p < facing.size(); ++p) {
    const std::span<Ray> pair = std::span(rays).subspan(p * count, count);
    make_pair_rays(i, facing[p].patch, pair.subspan(make_corner_rays(i, facing[p].patch, pair)));
  }
}

/// Writes those between the outermost points that face each other, and returns how many.
std::size_t ShadowRays::make_corner_rays(std::uint32_t i, std::uint32_t j,
                                         std::span<Ray> rays) const {
  std::size_t made = 0;
  for (std::uint32_t k = 0; k < kCornerRays && made < rays.size(); ++k) {
    const PatchPoint &x = geometry_.outermost_points(i)[k % 3],
                     &y = geometry_.outermost_points(j)[(k + k / 3) % 3];
    if (kernel(x, y) > 0) rays[made++] = ray_between(x, y);
  }
  return made;
}

/// Between points of sequences of the pair's own; those of the second patch, in each block of 64,
/// by steps of 19, so that every prefix covers all four dimensions.
void ShadowRays::make_pair_rays(std::uint32_t i, std::uint32_t j, std::span<Ray> rays) const {
  constexpr std::uint32_t kBlock = 64, kCandidates = 4;  // for each ray
  const std::uint64_t hash = pair_hash(i, j);
  const PointSequence from = r2_sequence(unit_square(hash)),
                      to = r2_sequence(unit_square(mix_bits(hash)));
  std::size_t made = 0;
  for (std::uint32_t k = 0; k < kCandidates * rays.size() && made < rays.size(); ++k) {
    const PatchPoint x = geometry_.point(i, from[k]),
                     y = geometry_.point(j, to[k / kBlock * kBlock + 19 * k % kBlock]);
    const float weight = kernel(x, y);
    if (!(weight > 0)) continue;
    Ray& ray = rays[made++];
    ray = ray_between(x, y);
    ray.id = std::bit_cast<std::uint32_t>(weight);
  }
  for (Ray& ray : rays.subspan(made)) ray = void_ray();
}

Ray ShadowRays::ray_between(const PatchPoint& x, const PatchPoint& y) {
  Ray ray{};
  ray.origin = x.position;
  ray.t_near = 0;
  ray.direction = to_float3(to_glm(y.position) - to_glm(x.position));
  ray.t_far = 1;
  return ray;
}

Ray ShadowRays::void_ray() {
  Ray ray{};
  ray.mask = 0;
  ray.t_near = ray.t_far = 0;
  ray.direction = {1, 0, 0};
  ray.id = kNone;
  return ray;
}

ShadowRays::Agreement ShadowRays::agreement(std::span<const Ray> rays,
                                            std::span<const float> transmitted) {
  bool all_clear = true, all_hidden = true;
  for (std::size_t k = 0; k < rays.size(); ++k) {
    if (is_void(rays[k])) continue;
    all_clear = all_clear && transmitted[k] == 1;
    all_hidden = all_hidden && transmitted[k] == 0;
  }
  if (all_hidden) return Agreement::kHidden;
  return all_clear ? Agreement::kClear : Agreement::kMixed;
}

ShadowRays::Visibility ShadowRays::visibility(std::span<const Ray> rays,
                                              std::span<const float> transmitted) {
  VisibilityEstimate estimate;
  add(rays, transmitted, estimate);
  if (estimate.is_empty()) return {0, 1, 0};
  return {estimate.part(), estimate.variance(), estimate.effective_count()};
}

void ShadowRays::add(std::span<const Ray> rays, std::span<const float> transmitted,
                     VisibilityEstimate& estimate) {
  for (std::size_t k = 0; k < rays.size(); ++k) {
    if (!is_void(rays[k])) estimate.add(ray_weight(rays[k]), transmitted[k]);
  }
}

}  // namespace rebounce
