#pragma once

#include <cstddef>
#include <memory>

#include "rebounce/precompute/progress.h"
#include "rebounce/transfer/dense_operator.h"
#include "rebounce/transfer/exchange_matrix.h"
#include "rebounce/transfer/low_rank_operator.h"

namespace rebounce {

struct LowRankSettings {
  std::size_t rank = 256;  ///< at least 1; more than there are patches is as many as there are
  Precision precision = Precision::kF16;  ///< or kF32
  /// Takes the first bounce through F, and the rank for what is left: several times more exact at
  /// the same rank, and an apply reads F as well.
  bool first_bounce = false;
};

/// The operator of low rank that is nearest to a dense one (f32) in the Frobenius norm of Yhat, all
/// channels together, up to the few per cent of its error that a randomised method may add where
/// the spectrum is flat.
///
/// With W = Yhat, or W = Yhat - G = G rho Yhat for the rest after the first bounce, the basis is
/// that of the leading eigenvectors of sum W_c², each channel's core V^T W_c V. G rho Yhat is
/// symmetric because Yhat = G + Yhat rho G; for one channel V S V^T is its truncated eigenvalue
/// decomposition, and no other addition to G of this rank is nearer (C. Eckart and G. Young, 1936).
/// Gathering F (M0 + rho V S V^T M0), with V those of Yhat, reads as much and is neither symmetric
/// nor nearer.
///
/// Up to some hundreds of patches the eigenvectors are found densely, above by subspace iteration
/// from a random start: N. Halko, P. G. Martinsson and J. A. Tropp, "Finding structure with
/// randomness", 2011, algorithm 4.4. `exchange` are the form factors. Throws Cancelled if asked to
/// stop.
std::shared_ptr<const LowRankOperator> build_low_rank_transfer(const DenseOperator& dense,
                                                               const ExchangeMatrix& exchange,
                                                               const LowRankSettings& settings,
                                                               const Progress& progress = {});

}  // namespace rebounce
