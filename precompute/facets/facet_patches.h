#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/facets/facets.h"
#include "precompute/patches/patch_model.h"

namespace rebounce {

/// Facets as patches: each facet is one patch or, where it is large or has many corners, several,
/// whose exchange adds up to its own.
struct FacetPatches {
  /// Only what form factors need is filled; the origin lies in the middle of the facets.
  PatchModel model;
  std::vector<std::uint32_t> patch_facet;  ///< [patches] ascending
};

/// `least_count` patches are aimed at where there are fewer facets. Throws Error if a facet crosses
/// itself, or has no area in single precision. The facets have passed check_facets().
FacetPatches make_facet_patches(const Facets& facets, std::size_t least_count);

}  // namespace rebounce
