#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/exchange/links/link_tree.h"
#include "precompute/exchange/pairs/shadow_rays.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// Shadow rays between the nodes of a tree. Immutable, usable from any number of threads, each with
/// its own scratch.
class LinkRays {
 public:
  static constexpr int kMostRays = static_cast<int>(ShadowRays::kMostRays);

  struct Scratch {
    std::vector<Ray> rays;           ///< those that have been traced
    std::vector<float> transmitted;  ///< by ray
  };

  LinkRays(const LinkTree& tree, const ShadowRays& shadow_rays, const RayTracer& tracer,
           std::uint64_t seed)
      : tree_(tree), shadow_rays_(shadow_rays), tracer_(tracer), seed_(seed) {}

  struct Visibility {
    double part = 0;       ///< fraction of the light of the pair that passes, [0, 1]
    double spread = 0;     ///< variance of single rays
    bool mixed = false;    ///< the nodes see each other in part
    bool divided = false;  ///< mixed, and two of the children do not see each other at all
  };

  /// What is asked for: the visibility, or only whether nodes see each other in full, in part or
  /// not at all. Then few rays are traced of those that see each other in part, and nothing but
  /// `mixed` is known of them.
  enum class Wanted : std::uint8_t { kVisibility, kKind };

  /// The visibility from `count` <= kMostRays rays between points spread over two nodes.
  Visibility trace(std::uint32_t a, std::uint32_t b, int count, Wanted wanted,
                   Scratch& scratch) const;

 private:
  class Joined;

  double first_part(const LinkNode& node) const;
  void trace(std::size_t begin, Scratch& scratch) const;
  static Visibility judge(const Scratch& scratch, std::span<const double> weight,
                          std::span<const int> children);
  static bool is_divided(const Scratch& scratch, std::span<const int> children);

  const LinkTree& tree_;
  const ShadowRays& shadow_rays_;
  const RayTracer& tracer_;
  std::uint64_t seed_;
};

}  // namespace rebounce
