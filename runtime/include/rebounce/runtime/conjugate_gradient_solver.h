#pragma once

#include <array>
#include <memory>
#include <vector>

#include "rebounce/runtime/radiosity_solver.h"
#include "rebounce/transfer/transfer_operator.h"

namespace rebounce {

/// Conjugate gradients (M. R. Hestenes, E. Stiefel, 1952) on the symmetric form of the system.
///
/// With R = rho^1/2 and B = M0 + R U, the system is (I - R F R) U = R F M0, self-adjoint in the
/// area-weighted inner product (A F is symmetric) and positive. It is A rho^-1 - A F with its own
/// diagonal A rho^-1 as the preconditioner on both sides, written so that nothing is divided by
/// rho: on black patches U is 0 and B = M0. The three channels go together, each with scalars of
/// its own.
///
/// With a stored operator Y, of these or of other reflectances, I + R Y R is the preconditioner:
/// the inverse itself where Y is exact. Directions are then kept conjugate in the flexible way
/// (G. H. Golub, Q. Ye, "Inexact preconditioned conjugate gradient method with inner-outer
/// iteration", 1999), which forgives a Y that is not exactly symmetric. It must be positive; a Y
/// that is not shows as divergence.
class ConjugateGradientSolver final : public RadiositySolver {
 public:
  /// `preconditioner` may be null. Throws Error if its number of patches is another, or it does not
  /// serve them all.
  ConjugateGradientSolver(const FormFactorOperator& form_factors, const RadiosityProblem& problem,
                          std::shared_ptr<const TransferOperator> preconditioner = nullptr);

 private:
  using Scalars = std::array<double, kChannelCount>;

  void begin(bool cold) override;
  SweepReport sweep() override;
  void finish() override;

  /// product_ = (I - R F R) direction_
  void multiply_direction();
  /// preconditioned_ = (I + R Y R) rest_, or rest_ itself
  void precondition();
  double radiosity_residual_norm() const;
  /// How much of the last direction the next one keeps, after a step that made <rest_,
  /// preconditioned_> be `next`.
  Scalars turn_of_direction(const Scalars& step, const Scalars& next) const;
  Scalars inner_product(std::span<const Float3> a, std::span<const Float3> b) const;

  std::shared_ptr<const TransferOperator> preconditioner_;
  std::vector<Float3> sqrt_reflectance_;
  std::vector<Float3> unknown_, rest_, direction_, preconditioned_, product_, scaled_;
  std::vector<float> transfer_workspace_;
  Scalars rest_square_{};  ///< <rest_, preconditioned_>
};

}  // namespace rebounce
