#include "runtime/solvers/refinement_solver.h"

#include <algorithm>

#include "rebounce/error.h"
#include "transfer/base/area_norm.h"

namespace rebounce {
namespace {

/// Growth of a residual below this fraction of |B| is rounding in single precision, not divergence.
constexpr double kRounding = 1e-6;

}  // namespace

RefinementSolver::RefinementSolver(const FormFactorOperator& form_factors,
                                   const RadiosityProblem& problem,
                                   std::shared_ptr<const TransferOperator> transfer)
    : RadiositySolver(form_factors, problem), transfer_(std::move(transfer)) {
  if (!transfer_) throw Error("solver: refinement needs an operator, and there is none");
  if (transfer_->patch_count() != patch_count()) {
    throw Error("solver: form factors and operator differ in their number of patches");
  }
  if (!transfer_->roles().all_are_both()) {
    throw Error(
        "solver: refinement needs an operator that serves all patches, and this one has receivers "
        "or sources; take an iterative method");
  }
  previous_.resize(patch_count());
  correction_.resize(patch_count());
  transfer_workspace_.resize(transfer_->workspace_size());
}

void RefinementSolver::begin(bool cold) {
  if (cold) {  // B = 0: the residual is M0
    std::ranges::fill(radiosity_, Float3{0, 0, 0});
    std::ranges::copy(initial_exitance_, residual_.begin());
    residual_norm_ = area_norm(residual_, area_);
  } else {
    residual_norm_ = compute_residual();
  }
}

RadiositySolver::SweepReport RefinementSolver::sweep() {
  transfer_->apply(residual_, correction_, transfer_workspace_, scheduler_);
  std::ranges::copy(radiosity_, previous_.begin());
  for (std::size_t i = 0; i < patch_count(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      radiosity_[i][c] += residual_[i][c] + reflectance_[i][c] * correction_[i][c];
    }
  }
  const double before = residual_norm_;
  residual_norm_ = compute_residual();
  if (residual_norm_ < before) return {.residual = residual_norm_, .measured = true};

  // The residual did not fall or is not a number: undo the sweep.
  std::ranges::copy(previous_, radiosity_.begin());
  residual_norm_ = compute_residual();
  const bool rounding = before <= kRounding * area_norm(radiosity_, area_);
  return {.residual = residual_norm_, .measured = true, .stuck = rounding, .diverged = !rounding};
}

}  // namespace rebounce
