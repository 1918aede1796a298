#pragma once

#include <memory>

#include "runtime/solvers/radiosity_solver.h"
#include "transfer/exchange/relaxation.h"

namespace rebounce {

/// Gauss-Seidel relaxation (Burenius, chapter 8): patch after patch,
/// B(i) = M0(i) + rho(i) sum over j of F(i,j) B(j), always with the newest values.
///
/// The sweeps are those of the form factors (SweepableFormFactors::make_relaxation), which know the
/// order in which they are read best. A symmetric solve turns around after every sweep; each
/// direction counts as one. On compressed form factors it reads half as much.
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
