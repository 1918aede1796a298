#pragma once

#include <span>
#include <vector>

#include "precompute/exchange/links/link_refinement.h"
#include "precompute/exchange/links/link_tree.h"
#include "precompute/exchange/pairs/closure.h"

namespace rebounce {

/// F x by links: out(i) = sum over j of F(i,j) x(j), over patches [n]. In double precision and a
/// fixed order.
std::vector<double> gather_links(const LinkTree& tree, std::span<const Link> links,
                                 std::span<const double> x);

struct LinkScaling {
  std::vector<double> factor;   ///< [n] d, of the patches
  std::vector<double> row_sum;  ///< [n] row sums after scaling
  ClosureReport closure;
};

/// Finds factors d of the patches such that the rows of D F D add up to their targets, where D is
/// the diagonal matrix of d. Reciprocity holds.
///
/// This is symmetric scaling (P. A. Knight, D. Ruiz and B. Uçar, "A symmetry preserving algorithm
/// for matrix scaling", 2014). What a row is off comes from pairs that are partly hidden and from
/// kernels that are taken for affine, and not from single patches with nothing between them. So
/// the links between patches of which rays tell a part first give way by their variances
/// (enforce_closure). Those between patches with nothing between, which move to the front, are
/// divided by the factors of their patches first, and only what the others leave is scaled off all
/// alike (lab/117). A measured target counts by its certainty relative to that of the row sum.
/// Factors stay in [0.8, 1.25], those of the others alone in [0.9, 1.1], with two exceptions:
/// patches that see almost nothing may lose nearly all of their exchange, and where the target is 0
/// the factor is 0.
LinkScaling scale_links(const LinkTree& tree, std::span<Link> links,
                        std::span<const RowSumTarget> target);

}  // namespace rebounce
