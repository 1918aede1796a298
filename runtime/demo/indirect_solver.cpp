#include "rebounce/demo/indirect_solver.h"

#include <algorithm>
#include <chrono>

namespace rebounce {

IndirectSolver::IndirectSolver(const TransferData& data, const FormFactorBlocks& form_factors)
    : data_(data),
      form_factors_(form_factors),
      indirect_irradiance_(data.patches.size()),
      workspace_(std::max(data.transfer->workspace_size(), form_factors.workspace_size())) {}

void IndirectSolver::choose(const IndirectMethod& method) {
  if (!method.iteration) {
    solver_.reset();
  } else if (!solver_ || method.iteration != method_.iteration) {
    solver_ = make_solver(*method.iteration, form_factors_,
                          {data_.patches.area, data_.patches.reflectance}, data_.transfer);
  }
  method_ = method;
}

std::span<const Float3> IndirectSolver::solve(std::span<const Float3> initial_exitance) {
  if (solver_) {
    iterate(initial_exitance);
  } else {
    apply(initial_exitance);
  }
  return indirect_irradiance_;
}

void IndirectSolver::apply(std::span<const Float3> initial_exitance) {
  const auto begin = std::chrono::steady_clock::now();
  data_.transfer->apply(initial_exitance, indirect_irradiance_, workspace_);
  const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - begin;
  microseconds_ = time.count();
}

void IndirectSolver::iterate(std::span<const Float3> initial_exitance) {
  SolveSettings settings;
  settings.max_sweeps = method_.sweeps;
  settings.residual = 0;
  settings.measure_residual = false;
  if (!method_.warm) solver_->forget();
  microseconds_ = solver_->solve(initial_exitance, settings).microseconds;
  form_factors_.gather(solver_->radiosity(), indirect_irradiance_, workspace_);
}

}  // namespace rebounce
