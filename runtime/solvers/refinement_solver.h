#pragma once

#include <memory>
#include <vector>

#include "runtime/solvers/radiosity_solver.h"
#include "transfer/operator/transfer_operator.h"

namespace rebounce {

/// Iterative refinement (J. H. Wilkinson, "Rounding errors in algebraic processes", 1963) with the
/// stored operator as preconditioner:
///   B <- B + (I + rho Y)(M0 - (I - rho F) B).
///
/// Without an earlier solution, the first sweep is the product with Y. Each sweep multiplies the
/// error by the relative error of Y, even if Y was built for other reflectances. If a sweep
/// increases the residual, the result is that of the sweep before, and the solve reports
/// divergence.
class RefinementSolver final : public RadiositySolver {
 public:
  /// Throws Error if `transfer` is null, has another number of patches or does not serve all
  /// patches.
  RefinementSolver(const FormFactorOperator& form_factors, const RadiosityProblem& problem,
                   std::shared_ptr<const TransferOperator> transfer);

 private:
  void begin(bool cold) override;
  SweepReport sweep() override;

  std::shared_ptr<const TransferOperator> transfer_;
  double residual_norm_ = 0;
  std::vector<Float3> previous_, correction_;
  std::vector<float> transfer_workspace_;
};

}  // namespace rebounce
