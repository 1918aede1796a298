#pragma once

#include <array>
#include <vector>

#include "runtime/solvers/radiosity_solver.h"

namespace rebounce {

/// Conjugate gradients (M. R. Hestenes, E. Stiefel, 1952) on the symmetric form of the system.
///
/// With R = rho^1/2 and B = M0 + R U the system is (I - R F R) U = R F M0. It is self-adjoint in
/// the area-weighted inner product, because A F is symmetric, and positive definite. It equals A
/// rho^-1 - A F with its diagonal A rho^-1 as preconditioner on both sides, but nothing is divided
/// by rho: on black patches U is 0 and B = M0. The three channels run together, each with scalars
/// of its own.
class ConjugateGradientSolver final : public RadiositySolver {
 public:
  ConjugateGradientSolver(const FormFactorOperator& form_factors, const RadiosityProblem& problem);

 private:
  using Scalars = std::array<double, kChannelCount>;

  void begin(bool cold) override;
  SweepReport sweep() override;
  void finish() override;

  /// product_ = (I - R F R) direction_
  void multiply_direction();
  double radiosity_residual_norm() const;

  std::vector<Float3> sqrt_reflectance_;
  std::vector<Float3> unknown_, symmetric_residual_, direction_, product_, scaled_;
  Scalars residual_square_{};  ///< <symmetric_residual_, symmetric_residual_>
};

}  // namespace rebounce
