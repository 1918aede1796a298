#pragma once

#include <memory>
#include <vector>

#include "runtime/solvers/radiosity_solver.h"
#include "transfer/operator/transfer_operator.h"

namespace rebounce {

/// Iterative refinement with the stored operator as the preconditioner:
/// B <- B + (I + rho Y)(M0 - (I - rho F) B).
///
/// The first sweep from nothing is the product with Y; each sweep shrinks the error by the relative
/// error of Y, also where Y is of other reflectances than the current ones. When a sweep makes the
/// residual grow, the one before is the result, and the solve reports divergence.
/// (J. H. Wilkinson, "Rounding errors in algebraic processes", 1963, for the iteration.)
class RefinementSolver final : public RadiositySolver {
 public:
  /// Throws Error if `transfer` is null, has another number of patches or does not serve them all.
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
