#pragma once

#include <cstddef>
#include <memory>

#include "precompute/base/progress.h"
#include "transfer/base/precision.h"
#include "transfer/operator/dense_operator.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {

struct LowRankSettings {
  std::size_t rank = 256;                 ///< at least 1; bounded by the number of patches
  Precision precision = Precision::kF16;  ///< or kF32
};

/// The operator of low rank that is nearest to a dense one (f32) in the Frobenius norm of Yhat, all
/// channels together: a hierarchical operator of one block. Where the spectrum is flat, the
/// randomised method may add a few per cent to its error.
///
/// The basis V holds the leading eigenvectors of sum Yhat_c²; the coupling matrix of a channel is
/// V^T Yhat_c V. For one channel V S V^T is the truncated eigenvalue decomposition, and no other
/// operator of this rank is nearer (C. Eckart and G. Young, 1936).
///
/// Up to some hundreds of patches the eigenvectors are found densely, above by subspace iteration
/// from a random start: N. Halko, P. G. Martinsson and J. A. Tropp, "Finding structure with
/// randomness", 2011, algorithm 4.4. Throws Cancelled if asked to stop.
std::shared_ptr<const HierarchicalOperator> build_low_rank_transfer(const DenseOperator& dense,
                                                                    const LowRankSettings& settings,
                                                                    const Progress& progress = {});

}  // namespace rebounce
