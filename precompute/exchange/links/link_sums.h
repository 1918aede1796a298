#pragma once

#include <span>
#include <vector>

#include "precompute/exchange/links/link_refinement.h"
#include "precompute/exchange/links/link_tree.h"
#include "precompute/exchange/pairs/closure.h"

namespace rebounce {

/// F x on links: out(i) = sum over j of F(i,j) x(j), over patches [n]. In double precision, in a
/// fixed order.
std::vector<double> gather_links(const LinkTree& tree, std::span<const Link> links,
                                 std::span<const double> x);

struct LinkScaling {
  std::vector<double> factor;   ///< [n] d, of the patches
  std::vector<double> row_sum;  ///< [n] with it
  ClosureReport closure;
};

/// Factors d of the patches with which rows of D F D add up to their targets, D the diagonal
/// matrix of d: reciprocity is kept, and no link changes.
///
/// Symmetric scaling (P. A. Knight, D. Ruiz, B. Uçar, "A symmetry preserving algorithm for matrix
/// scaling", 2014). A target that was measured counts for as much as it is more certain than the
/// row sum. Factors stay in [0.5, 2], but for patches that see next to nothing, which may lose
/// nearly all, and those whose target is 0, whose factor is.
LinkScaling scale_links(const LinkTree& tree, std::span<const Link> links,
                        std::span<const RowTarget> target);

}  // namespace rebounce
