#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "closure.h"
#include "link_refinement.h"
#include "link_tree.h"
#include "rebounce/precompute/progress.h"

namespace rebounce {

/// How the exchange of a link is shared out among its pairs of patches.
enum class LinkSpread : std::uint8_t {
  kKernel,  ///< by the exact unoccluded exchange of each pair, times the link's visibility
  kAffine,  ///< by areas and the link's gradients: what a product with the links amounts to
};

/// The links as pairs of patches: the upper triangle by rows, columns ascending. Pairs of
/// two patches come out as they went in, bit by bit.
///
/// Costs time and memory in proportion to the pairs that see each other, some n² / 4, but no rays.
/// Rows are shared out among OpenMP threads. Throws Cancelled when `progress` says so.
ExchangeRows expand_links(const LinkTree& tree, const ShadowRays& shadow_rays,
                          std::span<const Link> links, LinkSpread spread,
                          const Progress& progress = {});

}  // namespace rebounce
