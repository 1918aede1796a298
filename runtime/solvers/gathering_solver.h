#pragma once

#include "runtime/solvers/radiosity_solver.h"

namespace rebounce {

/// Gathering (Burenius, chapter 6): B <- M0 + rho F B, every patch at once from the values before,
/// one more bounce per sweep.
///
/// Jacobi's method is the same iteration: a flat patch does not see itself, so that the diagonal
/// of I - rho F is 1. The error shrinks per sweep by max(rho) or better.
class GatheringSolver : public RadiositySolver {
 public:
  GatheringSolver(const FormFactorOperator& form_factors, const RadiosityProblem& problem)
      : RadiositySolver(form_factors, problem) {}

 private:
  void begin(bool /*cold*/) override {}
  SweepReport sweep() override;
};

}  // namespace rebounce
