#include "precompute/exchange/links/link_rays.h"

#include <algorithm>
#include <array>

#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

// The number of rays that shows that two nodes do not see each other at all.
constexpr int kEnoughRays = 6;

// Where only the kind of visibility is asked for, rays are traced in so many parts. Each is spread
// over both nodes.
constexpr int kParts = 4;

/// Whether some of the rays pass and others do not.
bool is_mixed(const LinkRays::Scratch& scratch) {
  return ShadowRays::agreement(scratch.rays, scratch.transmitted) == ShadowRays::Agreement::kMixed;
}

}  // namespace

/// Traces the rays from number `begin` on. As for form factors of pairs: where a surface has holes,
/// the mean of a triangle is used.
void LinkRays::trace(std::size_t begin, Scratch& scratch) const {
  scratch.transmitted.resize(scratch.rays.size());
  tracer_.transmittance(std::span(scratch.rays).subspan(begin), PassageDetail::kTriangle,
                        std::span(scratch.transmitted).subspan(begin));
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

/// The rays between two nodes. Strata of equal area of one are joined to those of the other in
/// steps of a prime that does not divide their number.
class LinkRays::Joined {
 public:
  Joined(const LinkRays& rays, std::uint32_t a, std::uint32_t b, int count)
      : tree_(rays.tree_),
        geometry_(rays.shadow_rays_.geometry()),
        a_(tree_[a]),
        b_(tree_[b]),
        count_(count),
        step_(count % 19 == 0 ? 17 : 19),
        hash_(mix_bits(rays.seed_ * 0x9E3779B9ULL + ((static_cast<std::uint64_t>(a) << 32) | b))),
        first_(static_cast<int>(hash_ % kMostRays)),
        shift_(unit_square(mix_bits(hash_))),
        from_(r2_sequence(unit_square(hash_))),
        to_(r2_sequence(unit_square(mix_bits(hash_ + 1)))),
        first_part_{rays.first_part(a_), rays.first_part(b_)} {}

  struct Joint {
    Ray ray;
    double weight;
    int children;  ///< the pair of children that the ray joins, [0, 4)
  };

  /// Points that do not face each other exchange no light.
  Joint at(int k) const {
    const int other = (step_ * k + first_) % count_;
    const double along_a = (k + shift_.x) / count_, along_b = (other + shift_.y) / count_;
    const PatchPoint x = geometry_.point(tree_.patch_at(a_, along_a), from_[k]),
                     y = geometry_.point(tree_.patch_at(b_, along_b), to_[7 * k]);
    const float weight = ShadowRays::kernel(x, y);
    return {weight > 0 ? ShadowRays::ray_between(x, y, weight) : ShadowRays::void_ray(), weight,
            2 * (along_a < first_part_[0] ? 0 : 1) + (along_b < first_part_[1] ? 0 : 1)};
  }

 private:
  const LinkTree& tree_;
  const PatchGeometry& geometry_;
  const LinkNode &a_, &b_;
  const int count_, step_;
  const std::uint64_t hash_;
  const int first_;
  const glm::dvec2 shift_;
  const PointSequence from_, to_;
  const std::array<double, 2> first_part_;
};

LinkRays::Visibility LinkRays::trace(std::uint32_t a, std::uint32_t b, int count, Wanted wanted,
                                     Scratch& scratch) const {
  const Joined joined(*this, a, b, count);
  scratch.rays.clear();
  std::array<double, kMostRays> weight;
  std::array<int, kMostRays> children;
  const int parts = wanted == Wanted::kKind ? kParts : 1;
  for (int part = 0; part < parts; ++part) {
    const std::size_t begin = scratch.rays.size();
    for (int k = part; k < count; k += parts) {
      const Joined::Joint joint = joined.at(k);
      weight[scratch.rays.size()] = joint.weight;
      children[scratch.rays.size()] = joint.children;
      scratch.rays.push_back(joint.ray);
    }
    trace(begin, scratch);
    if (part + 1 < parts && is_mixed(scratch)) {
      Visibility visible;
      visible.mixed = true;
      return visible;
    }
  }
  return judge(scratch, std::span(weight).first(scratch.rays.size()), children);
}

LinkRays::Visibility LinkRays::judge(const Scratch& scratch, std::span<const double> weight,
                                     std::span<const int> children) {
  VisibilityEstimate estimate;
  for (std::size_t k = 0; k < weight.size(); ++k) estimate.add(weight[k], scratch.transmitted[k]);
  if (estimate.is_empty()) return {1, 1, true, true};  // no ray has weight
  const bool divided = estimate.part() > 0 && is_divided(scratch, children);
  return {estimate.part(), estimate.spread(), divided || is_mixed(scratch), divided};
}

}  // namespace rebounce
