#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "link_tree.h"
#include "rebounce/runtime/ray_tracer.h"
#include "shadow_rays.h"

namespace rebounce {

/// Shadow rays between the nodes of a tree. Immutable, usable from any number of threads, each with
/// scratch of its own.
class LinkRays {
 public:
  static constexpr int kMostRays = static_cast<int>(ShadowRays::kPointCount);

  struct Scratch {
    std::vector<Ray> rays;
    std::vector<FacingPatch> facing;
  };

  LinkRays(const LinkTree& tree, const ShadowRays& shadow_rays, const RayTracer& tracer,
           std::uint64_t seed)
      : tree_(tree), shadow_rays_(shadow_rays), tracer_(tracer), seed_(seed) {}

  struct Visibility {
    double part;      ///< of the pair's light that gets through, [0, 1]
    double variance;  ///< of `part`
    bool mixed;       ///< not all of either sees all of the other, or nothing
    bool divided;     ///< mixed, and two of the nodes' children see nothing of each other
  };

  /// What `count` <= kMostRays rays between points spread over two nodes say. Two patches have the
  /// rays that ShadowRays gives them.
  Visibility trace(std::uint32_t a, std::uint32_t b, int count, Scratch& scratch) const;

 private:
  Visibility trace_patches(std::uint32_t i, std::uint32_t j, int count, Scratch& scratch) const;
  Visibility trace_nodes(std::uint32_t a, std::uint32_t b, int count, Scratch& scratch) const;
  double first_part(const LinkNode& node) const;
  static Visibility judge(std::span<const Ray> rays, std::span<const double> weight,
                          std::span<const int> children);
  static bool is_divided(std::span<const Ray> rays, std::span<const int> children);

  const LinkTree& tree_;
  const ShadowRays& shadow_rays_;
  const RayTracer& tracer_;
  std::uint64_t seed_;
};

}  // namespace rebounce
