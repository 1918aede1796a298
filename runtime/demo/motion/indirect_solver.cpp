#include "runtime/demo/motion/indirect_solver.h"

#include <algorithm>
#include <chrono>

#include "rebounce/error.h"
#include "runtime/solvers/hierarchical_solver.h"

namespace rebounce {

IndirectSolver::IndirectSolver(const TransferData& data)
    : data_(data),
      indirect_irradiance_(data.patches.size()),
      workspace_(data.transfer->workspace_size()) {}

void IndirectSolver::choose(const IndirectMethod& method) {
  if (!method.iterates()) {
    solver_.reset();
    form_factors_.reset();
  } else if (!solver_ || method.iteration != method_.iteration ||
             method.on_links != method_.on_links) {
    make_iteration(method);
  }
  method_ = method;
}

void IndirectSolver::make_iteration(const IndirectMethod& method) {
  const RadiosityProblem problem{data_.patches.area, data_.patches.reflectance};
  if (method.on_links) {
    if (data_.links.empty()) {
      throw Error("the transfer file has no links; make it again with precompute --store-links");
    }
    auto links = std::make_unique<const LinkedFormFactors>(data_.links, data_.patches.area,
                                                           data_.patches.centroid);
    solver_ = std::make_unique<HierarchicalSolver>(*links, problem);
    form_factors_ = std::move(links);
  } else {
    auto form = make_form_factors(*method.iteration, data_);
    solver_ = make_solver(*method.iteration, *form, problem, data_.transfer);
    form_factors_ = std::move(form);
  }
  workspace_.resize(std::max(data_.transfer->workspace_size(), form_factors_->workspace_size()));
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
  if (!method_.warm) solver_->reset();
  microseconds_ = solver_->solve(initial_exitance, settings).microseconds;
  form_factors_->gather(solver_->radiosity(), indirect_irradiance_, workspace_);
}

}  // namespace rebounce
