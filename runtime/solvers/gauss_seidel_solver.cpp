#include "runtime/solvers/gauss_seidel_solver.h"

#include <cmath>

namespace rebounce {

GaussSeidelSolver::GaussSeidelSolver(const SweepableFormFactors& form_factors,
                                     const RadiosityProblem& problem, SweepOrder order)
    : RadiositySolver(form_factors, problem),
      relaxation_(form_factors.make_relaxation()),
      order_(order) {}

void GaussSeidelSolver::begin(bool /*cold*/) {
  relaxation_->begin({area_, reflectance_, initial_exitance_}, radiosity_);
  next_ = SweepDirection::kForward;
}

RadiositySolver::SweepReport GaussSeidelSolver::sweep() {
  const double changed_squared = relaxation_->sweep(next_, scheduler_);
  if (order_ == SweepOrder::kSymmetric) {
    next_ =
        next_ == SweepDirection::kForward ? SweepDirection::kBackward : SweepDirection::kForward;
  }
  // The change of a row is its residual when it is relaxed. The residual after the sweep is rho
  // times one triangle of F times the changes.
  return {.residual = std::sqrt(changed_squared)};
}

void GaussSeidelSolver::finish() {
  relaxation_->end(radiosity_);
}

}  // namespace rebounce
