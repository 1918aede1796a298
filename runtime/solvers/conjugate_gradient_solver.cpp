#include "runtime/solvers/conjugate_gradient_solver.h"

#include <algorithm>
#include <cmath>

#include "transfer/base/area_norm.h"

namespace rebounce {
namespace {

/// out = r in, by patch and channel.
void scale(std::span<const Float3> r, std::span<const Float3> in, std::span<Float3> out) {
  for (std::size_t i = 0; i < out.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) out[i][c] = r[i][c] * in[i][c];
  }
}

/// y += factor x, with one factor per channel.
void add_scaled(const std::array<double, kChannelCount>& factor, std::span<const Float3> x,
                std::span<Float3> y) {
  for (std::size_t i = 0; i < y.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      y[i][c] = static_cast<float>(y[i][c] + factor[c] * x[i][c]);
    }
  }
}

}  // namespace

ConjugateGradientSolver::ConjugateGradientSolver(const FormFactorOperator& form_factors,
                                                 const RadiosityProblem& problem)
    : RadiositySolver(form_factors, problem) {
  for (auto* vector :
       {&sqrt_reflectance_, &unknown_, &symmetric_residual_, &direction_, &product_, &scaled_}) {
    vector->resize(patch_count());
  }
}

void ConjugateGradientSolver::begin(bool cold) {
  for (std::size_t i = 0; i < patch_count(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) sqrt_reflectance_[i][c] = std::sqrt(reflectance_[i][c]);
  }
  // U = R H with H = F B of the starting point: no division is needed, whatever B and rho were
  // before.
  if (cold) {
    std::ranges::fill(unknown_, Float3{0, 0, 0});
  } else {
    form_factors_.gather(radiosity_, scaled_, gather_workspace_, scheduler_);
    scale(sqrt_reflectance_, scaled_, unknown_);
    finish();
  }
  form_factors_.gather(radiosity_, scaled_, gather_workspace_, scheduler_);
  scale(sqrt_reflectance_, scaled_, symmetric_residual_);
  add_scaled({-1, -1, -1}, unknown_, symmetric_residual_);
  direction_ = symmetric_residual_;
  residual_square_ = area_inner_product(symmetric_residual_, symmetric_residual_, area_);
}

RadiositySolver::SweepReport ConjugateGradientSolver::sweep() {
  multiply_direction();
  const Scalars curvature = area_inner_product(direction_, product_, area_);
  Scalars alpha{}, minus_alpha{};
  for (int c = 0; c < kChannelCount; ++c) {
    if (residual_square_[c] == 0) continue;  // this channel is solved
    if (!(curvature[c] > 0 && residual_square_[c] > 0 && std::isfinite(residual_square_[c]))) {
      return {.residual = radiosity_residual_norm(), .diverged = true};
    }
    alpha[c] = residual_square_[c] / curvature[c];
    minus_alpha[c] = -alpha[c];
  }
  add_scaled(alpha, direction_, unknown_);
  add_scaled(minus_alpha, product_, symmetric_residual_);
  const Scalars next = area_inner_product(symmetric_residual_, symmetric_residual_, area_);
  Scalars beta{};
  for (int c = 0; c < kChannelCount; ++c) {
    if (residual_square_[c] > 0) beta[c] = next[c] / residual_square_[c];
  }
  residual_square_ = next;
  for (std::size_t i = 0; i < patch_count(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      direction_[i][c] = static_cast<float>(symmetric_residual_[i][c] + beta[c] * direction_[i][c]);
    }
  }
  return {.residual = radiosity_residual_norm()};
}

void ConjugateGradientSolver::finish() {
  for (std::size_t i = 0; i < patch_count(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      radiosity_[i][c] = initial_exitance_[i][c] + sqrt_reflectance_[i][c] * unknown_[i][c];
    }
  }
}

void ConjugateGradientSolver::multiply_direction() {
  scale(sqrt_reflectance_, direction_, scaled_);
  form_factors_.gather(scaled_, product_, gather_workspace_, scheduler_);
  for (std::size_t i = 0; i < patch_count(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      product_[i][c] = direction_[i][c] - sqrt_reflectance_[i][c] * product_[i][c];
    }
  }
}

double ConjugateGradientSolver::radiosity_residual_norm() const {
  // M0 + rho F B - B = R (R F B - U) = R times the residual of the symmetric system.
  Scalars sum{};
  for (std::size_t i = 0; i < patch_count(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      const double residual = symmetric_residual_[i][c];
      sum[c] += static_cast<double>(area_[i]) * reflectance_[i][c] * residual * residual;
    }
  }
  return std::sqrt(sum[0] + sum[1] + sum[2]);
}

}  // namespace rebounce
