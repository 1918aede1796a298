#include "precompute/exchange/links/link_rays.h"

#include <algorithm>
#include <array>

#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

// The number of rays that shows that two nodes do not see each other at all.
constexpr int kEnoughRays = 6;

}  // namespace

/// As for form factors of pairs: where a surface has holes, the mean of a triangle is used.
void LinkRays::trace(Scratch& scratch) const {
  scratch.transmitted.resize(scratch.rays.size());
  tracer_.transmittance(scratch.rays, PassageDetail::kTriangle, scratch.transmitted);
}

/// The fraction of the area of a node that belongs to its first child.
double LinkRays::first_part(const LinkNode& node) const {
  return node.is_leaf() ? 1 : tree_[node.first_child].area / node.area;
}

/// True if no ray between two of the children passes, and there are enough rays to tell: the two
/// are hidden from each other or do not face each other.
bool LinkRays::is_divided(const Scratch& scratch, std::span<const int> children) {
  std::array<int, 4> seen{}, count{};
  for (std::size_t k = 0; k < scratch.rays.size(); ++k) {
    const bool clear = !ShadowRays::is_void(scratch.rays[k]) && scratch.transmitted[k] > 0;
    ++count[children[k]];
    seen[children[k]] += clear ? 1 : 0;
  }
  for (int pair = 0; pair < 4; ++pair) {
    if (count[pair] >= kEnoughRays && seen[pair] == 0) return true;
  }
  return false;
}

LinkRays::Visibility LinkRays::trace(std::uint32_t a, std::uint32_t b, int count,
                                     Scratch& scratch) const {
  const std::uint64_t hash =
      mix_bits(seed_ * 0x9E3779B9ULL + ((static_cast<std::uint64_t>(a) << 32) | b));
  const glm::dvec2 shift = unit_square(mix_bits(hash));
  const auto first = static_cast<int>(hash % kMostRays);
  const PointSequence from = r2_sequence(unit_square(hash)),
                      to = r2_sequence(unit_square(mix_bits(hash + 1)));
  // Strata of equal area of one node are joined to those of the other in steps of a prime that does
  // not divide their number.
  const int step = count % 19 == 0 ? 17 : 19;
  scratch.rays.resize(count);
  std::array<double, kMostRays> weight;
  std::array<int, kMostRays> children;  // the pair of children that each ray joins
  for (int k = 0; k < count; ++k) {
    const int other = (step * k + first) % count;
    const double along_a = (k + shift.x) / count, along_b = (other + shift.y) / count;
    const std::uint32_t i = tree_.patch_at(tree_[a], along_a),
                        j = tree_.patch_at(tree_[b], along_b);
    children[k] =
        2 * (along_a < first_part(tree_[a]) ? 0 : 1) + (along_b < first_part(tree_[b]) ? 0 : 1);
    const PatchPoint x = shadow_rays_.geometry().point(i, from[k]),
                     y = shadow_rays_.geometry().point(j, to[7 * k]);
    weight[k] = ShadowRays::kernel(x, y);
    // Points that do not face each other exchange no light.
    scratch.rays[k] = weight[k] > 0 ? ShadowRays::ray_between(x, y, static_cast<float>(weight[k]))
                                    : ShadowRays::void_ray();
  }
  trace(scratch);
  return judge(scratch, std::span(weight).first(count), children);
}

LinkRays::Visibility LinkRays::judge(const Scratch& scratch, std::span<const double> weight,
                                     std::span<const int> children) {
  VisibilityEstimate estimate;
  for (std::size_t k = 0; k < weight.size(); ++k) estimate.add(weight[k], scratch.transmitted[k]);
  if (estimate.is_empty()) return {1, 1, true, true};  // no ray has weight
  const bool divided = estimate.part() > 0 && is_divided(scratch, children);
  const bool mixed = divided || ShadowRays::agreement(scratch.rays, scratch.transmitted) ==
                                    ShadowRays::Agreement::kMixed;
  return {estimate.part(), estimate.spread(), mixed, divided};
}

}  // namespace rebounce
