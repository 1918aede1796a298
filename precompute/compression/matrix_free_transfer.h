#pragma once

#include <memory>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/compression/matrix_free_plan.h"
#include "precompute/inverse/solved_transfer.h"
#include "precompute/lights/fitting_lights.h"
#include "transfer/file/transfer_data.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {

/// Builds Y = F (I - rho F)^-1, compressed, without any matrix of all pairs. What bounces twice and
/// more, Yhat - G, is far smoother than G. It is solved for by conjugate gradients in bases of
/// cells of neighbouring patches, which random samples give (sampled_bases.h): a fraction of as
/// many solves as it has columns, which falls as patches become more. The matrix in these bases is
/// then compressed to the tolerance as build_hierarchical_transfer does, as often as wanted.
///
/// `form_factors` are a compressed G = A^1/2 F A^-1/2 in f32 or f16 (compress_form_factors). Their
/// error stays in the result and must be well below the tolerance; the reported error does not
/// contain it. The bits do not depend on the number of threads, the memory limit or the checkpoint.
class MatrixFreeTransfer {
 public:
  /// Solves for the matrix in its bases. All arguments but the lights must outlive the object;
  /// `training`: the training lights of FittingLights.
  /// Throws Error if the least memory is above the limit, which is known for certain once there are
  /// bases, if F is not a passive exchange (I - R G R
  /// not positive definite), or if the checkpoint cannot be written; Cancelled if asked to stop.
  MatrixFreeTransfer(const HierarchicalOperator& form_factors, const PatchTable& patches,
                     std::span<const std::vector<Float3>> training,
                     const MatrixFreeTransferSettings& settings, const Progress& progress = {});
  ~MatrixFreeTransfer();
  MatrixFreeTransfer(const MatrixFreeTransfer&) = delete;
  MatrixFreeTransfer& operator=(const MatrixFreeTransfer&) = delete;

  /// The operator of a `tolerance` that is that of the settings or, at the least, half of it. Below
  /// that of the settings the error may be a fifth larger than the tolerance, because the columns
  /// stay as exact as the settings ask. Throws likewise.
  std::shared_ptr<const HierarchicalOperator> compress(FittingLights lights, double tolerance,
                                                       const Progress& progress = {}) const;

  /// Products with the inverse of `form_factors`, as exact as the bases need.
  const SolvedTransfer& solved() const;

  /// Vectors that were solved for, or found in the checkpoint: samples for the bases, and vectors
  /// of the bases.
  std::size_t solve_count() const;

  /// The part of the time that solving takes, for progress.
  double solving_part() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The operator of the tolerance of the settings.
std::shared_ptr<const HierarchicalOperator> build_matrix_free_transfer(
    const HierarchicalOperator& form_factors, const PatchTable& patches, FittingLights lights,
    const MatrixFreeTransferSettings& settings, const Progress& progress = {});

}  // namespace rebounce
