#pragma once

#include <memory>

#include "runtime/solvers/radiosity_solver.h"
#include "transfer/exchange/relaxation.h"

namespace rebounce {

/// Gauss-Seidel relaxation (Burenius, chapter 8): patch after patch,
///   B(i) = M0(i) + rho(i) sum over j of F(i,j) B(j),
/// always with the newest values.
///
/// The form factors make the sweeps, in the order that suits their storage
/// (SweepableFormFactors::make_relaxation). A symmetric solve alternates the direction; each
/// direction counts as one sweep. On compressed form factors this halves the memory reads.
class GaussSeidelSolver final : public RadiositySolver {
 public:
  GaussSeidelSolver(const SweepableFormFactors& form_factors, const RadiosityProblem& problem,
                    SweepOrder order = SweepOrder::kForward);

 private:
  void begin(bool cold) override;
  SweepReport sweep() override;
  void finish() override;

  std::unique_ptr<Relaxation> relaxation_;
  SweepOrder order_;
  SweepDirection next_ = SweepDirection::kForward;
};

}  // namespace rebounce
