#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "closure.h"
#include "link_refinement.h"
#include "link_tree.h"
#include "rebounce/precompute/progress.h"

namespace rebounce {

/// The links as pairs of patches: the upper triangle by rows, columns ascending. The exchange of
/// a pair is its own with nothing between times the link's visibility. Pairs of two patches come
/// out as they went in, bit by bit.
///
/// Costs time and memory in proportion to the pairs that see each other, some n² / 4, but no rays.
/// Rows are shared out among OpenMP threads. Throws Cancelled when `progress` says so.
ExchangeRows expand_links(const LinkTree& tree, const ShadowRays& shadow_rays,
                          std::span<const Link> links, const Progress& progress = {});

}  // namespace rebounce
