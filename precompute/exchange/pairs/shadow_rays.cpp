#include "precompute/exchange/pairs/shadow_rays.h"

#include <cstddef>

#include "precompute/sampling/sobol_blocks.h"

namespace rebounce {
namespace {

// Pairs of patches whose numbers agree except for this number of low bits, mostly neighbours, share
// their points. Their errors are then similar, so that blocks of far pairs have lower rank, and
// rows still average many different points (lab/004).
constexpr int kSharedBits = 4;

/// Evaluates ShadowRays::kernel() between the first `count` points of two blocks.
void find_kernels(const PatchPointBlock& from, const PatchPointBlock& to, std::size_t count,
                  PatchPointBlock::Coordinates& kernel) {
  for (std::size_t k = 0; k < count; ++k) {
    float squared = 0, cx = 0, cy = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const float d = to.position[axis][k] - from.position[axis][k];
      squared += d * d;
      cx += from.normal[axis][k] * d;
      cy -= to.normal[axis][k] * d;
    }
    const float inverse = 1 / squared;
    kernel[k] = std::max(cx, 0.0F) * inverse * (std::max(cy, 0.0F) * inverse) *
                std::numbers::inv_pi_v<float>;
  }
}

PatchPoint point_of(const PatchPointBlock& block, std::size_t k) {
  return {{block.position[0][k], block.position[1][k], block.position[2][k]},
          {block.normal[0][k], block.normal[1][k], block.normal[2][k]}};
}

}  // namespace

std::uint64_t ShadowRays::shift_of_pair(std::uint32_t i, std::uint32_t j) const {
  const std::uint64_t first = i >> kSharedBits, second = j >> kSharedBits;
  return mix_bits(seed_ * 0x9E3779B9ULL + ((first << 32) | second));
}

void ShadowRays::make_rays(std::uint32_t i, std::span<const FacingPatch> facing, int count,
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

/// Writes the rays between the outermost points that face each other, and returns their number.
std::size_t ShadowRays::make_corner_rays(std::uint32_t i, std::uint32_t j,
                                         std::span<Ray> rays) const {
  std::size_t made = 0;
  for (std::uint32_t k = 0; k < kCornerRays && made < rays.size(); ++k) {
    const PatchPoint &x = geometry_.outermost_points(i)[k % 3],
                     &y = geometry_.outermost_points(j)[(k + k / 3) % 3];
    const float weight = kernel(x, y);
    if (weight > 0) rays[made++] = ray_between(x, y, weight);
  }
  return made;
}

void ShadowRays::make_pair_rays(std::uint32_t i, std::uint32_t j, std::span<Ray> rays) const {
  constexpr std::size_t kBlock = SobolBlocks::kSize, kCandidates = 4;  // weights, one per ray
  const SobolBlocks sequence(shift_of_pair(i, j));
  SobolBlocks::Block square;
  PatchPointBlock from, to;
  PatchPointBlock::Coordinates weight;
  std::size_t made = 0;
  const std::size_t most = kCandidates * rays.size();
  // Usually as many candidates as rays all face each other; the others are looked at after them.
  std::size_t begin = 0, end = std::min(kBlock, rays.size());
  while (begin < most && made < rays.size()) {
    const std::size_t block = begin / kBlock, first = block * kBlock, count = end - first;
    sequence.fill(static_cast<std::uint32_t>(block), count, square);
    geometry_.points(i, count, square[0], square[1], from);
    geometry_.points(j, count, square[2], square[3], to);
    find_kernels(from, to, count, weight);
    for (std::size_t k = begin - first; k < count && made < rays.size(); ++k) {
      if (weight[k] > 0) rays[made++] = ray_between(point_of(from, k), point_of(to, k), weight[k]);
    }
    begin = end;
    end = std::min(most, (begin / kBlock + 1) * kBlock);
  }
  for (Ray& ray : rays.subspan(made)) ray = void_ray();
}

Ray ShadowRays::void_ray() {
  Ray ray{};
  ray.mask = 0;
  ray.t_near = ray.t_far = 0;
  ray.direction = {1, 0, 0};
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

/// Uses four sums that do not depend on each other. Void rays have weight 0.
void ShadowRays::add(std::span<const Ray> rays, std::span<const float> transmitted,
                     VisibilityEstimate& estimate) {
  constexpr std::size_t kLanes = 4;
  std::array<VisibilityEstimate, kLanes> lane;
  const std::size_t whole = rays.size() / kLanes * kLanes;
  for (std::size_t k = 0; k < whole; k += kLanes) {
    for (std::size_t l = 0; l < kLanes; ++l) {
      lane[l].add(ray_weight(rays[k + l]), transmitted[k + l]);
    }
  }
  for (std::size_t k = whole; k < rays.size(); ++k) {
    lane[0].add(ray_weight(rays[k]), transmitted[k]);
  }
  for (const VisibilityEstimate& part : lane) estimate.add(part);
}

}  // namespace rebounce
