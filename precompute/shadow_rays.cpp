#include "shadow_rays.h"

#include "rebounce/runtime/sampling.h"

namespace rebounce {

std::uint64_t ShadowRays::pair_hash(std::uint32_t i, std::uint32_t j) const {
  return mix_bits(seed_ * 0x9E3779B9ULL + ((static_cast<std::uint64_t>(i) << 32) | j));
}

/// The points that ray k of the pair (i, j) joins. Both walk the patches' point sets from starts of
/// the pair's own; the second, in each block of 64, by steps of 19, so that every prefix covers all
/// four dimensions.
std::pair<const PatchPoint*, const PatchPoint*> ShadowRays::ray_ends(std::uint32_t i,
                                                                     std::uint32_t j,
                                                                     std::uint32_t k,
                                                                     std::uint64_t hash) const {
  constexpr std::uint32_t kBlock = 64;
  const std::uint32_t first = k / kBlock * kBlock, round = k / kPointCount;
  const std::uint32_t a = (k + static_cast<std::uint32_t>(hash)) % kPointCount;
  const std::uint32_t b =
      (first + 19 * k % kBlock + 7 * round + static_cast<std::uint32_t>(hash >> 32)) % kPointCount;
  return {&geometry_.points(i)[a], &geometry_.points(j)[b]};
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
    const PatchPoint &x = geometry_.points(i)[geometry_.outermost_points(i)[k % 3]],
                     &y = geometry_.points(j)[geometry_.outermost_points(j)[(k + k / 3) % 3]];
    if (faces(x, y)) rays[made++] = ray_between(x, y);
  }
  return made;
}

void ShadowRays::make_pair_rays(std::uint32_t i, std::uint32_t j, std::span<Ray> rays) const {
  const std::uint64_t hash = pair_hash(i, j);
  std::size_t made = 0;
  for (std::uint32_t k = 0; k < kCandidateCount && made < rays.size(); ++k) {
    const auto [x, y] = ray_ends(i, j, k, hash);
    if (!faces(*x, *y)) continue;
    Ray& ray = rays[made++];
    ray = ray_between(*x, *y);
    ray.id = k;
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

ShadowRays::Visibility ShadowRays::visibility(std::uint32_t i, std::uint32_t j,
                                              std::span<const Ray> rays,
                                              std::span<const float> transmitted) const {
  VisibilityEstimate estimate;
  add(i, j, rays, transmitted, estimate);
  if (estimate.is_empty()) return {0, 1, 0};
  return {estimate.part(), estimate.variance(), estimate.effective_count()};
}

void ShadowRays::add(std::uint32_t i, std::uint32_t j, std::span<const Ray> rays,
                     std::span<const float> transmitted, VisibilityEstimate& estimate) const {
  const std::uint64_t hash = pair_hash(i, j);
  for (std::size_t k = 0; k < rays.size(); ++k) {
    if (is_void(rays[k])) continue;
    const auto [x, y] = ray_ends(i, j, rays[k].id, hash);
    estimate.add(kernel(*x, *y), transmitted[k]);
  }
}

}  // namespace rebounce
