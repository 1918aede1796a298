#pragma once

#include "runtime/solvers/radiosity_solver.h"

namespace rebounce {

/// Gathering (Burenius, chapter 6): B <- M0 + rho F B for all patches at once, from the values of
/// the sweep before. Each sweep adds one bounce.
///
/// Jacobi's method is the same iteration: a flat patch does not see itself, so the diagonal of I -
/// rho F is 1. A sweep multiplies the error by max(rho) or less.
class GatheringSolver : public RadiositySolver {
 public:
  GatheringSolver(const FormFactorOperator& form_factors, const RadiosityProblem& problem)
      : RadiositySolver(form_factors, problem) {}

 private:
  void begin(bool /*cold*/) override {}
  SweepReport sweep() override;
};

}  // namespace rebounce
