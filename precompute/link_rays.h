#pragma once

#include <cstdint>
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

  /// What `count` <= kMostRays rays between points spread over two nodes say. Two patches have the
  /// rays that ShadowRays gives them.
  ShadowRays::Visibility trace(std::uint32_t a, std::uint32_t b, int count, Scratch& scratch) const;

 private:
  ShadowRays::Visibility trace_patches(std::uint32_t i, std::uint32_t j, int count,
                                       Scratch& scratch) const;
  ShadowRays::Visibility trace_nodes(std::uint32_t a, std::uint32_t b, int count,
                                     Scratch& scratch) const;

  const LinkTree& tree_;
  const ShadowRays& shadow_rays_;
  const RayTracer& tracer_;
  std::uint64_t seed_;
};

}  // namespace rebounce
