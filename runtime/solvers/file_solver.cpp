#include "rebounce/solvers.h"

#include "rebounce/error.h"
#include "runtime/solvers/file_form_factors.h"
#include "runtime/solvers/solve_radiosity.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {
struct Solver::Parts {
  Parts(std::shared_ptr<const TransferData> of, SolveMethod method, FormFactorSource source)
      : data(std::move(of)),
        form_factors(take_form_factors(*data, method, source)),
        solver(make_solver(method, *form_factors, {data->patches.area, data->patches.reflectance},
                           data->transfer)) {}

  std::shared_ptr<const TransferData> data;
  std::unique_ptr<const FormFactorOperator> form_factors;
  std::unique_ptr<RadiositySolver> solver;
};

Solver::Solver(std::shared_ptr<const TransferData> data, SolveMethod method,
               FormFactorSource source) {
  if (!data) throw Error("solver: there are no transfer data");
  parts_ = std::make_unique<Parts>(std::move(data), method, source);
}

Solver::~Solver() = default;
Solver::Solver(Solver&&) noexcept = default;
Solver& Solver::operator=(Solver&&) noexcept = default;

SolveResult Solver::solve(std::span<const Float3> initial_exitance, const SolveSettings& settings) {
  return parts_->solver->solve(initial_exitance, settings);
}

SolveResult Solver::solve(std::span<const Float3> initial_exitance, const SolveSettings& settings,
                          std::span<Float3> radiosity) {
  return parts_->solver->solve(initial_exitance, settings, radiosity);
}

std::span<const Float3> Solver::radiosity() const {
  return parts_->solver->radiosity();
}

void Solver::set_reflectance(std::span<const Float3> reflectance) {
  parts_->solver->set_reflectance(reflectance);
}

void Solver::start_from(std::span<const Float3> radiosity) {
  parts_->solver->start_from(radiosity);
}

void Solver::reset() {
  parts_->solver->reset();
}

std::size_t Solver::patch_count() const {
  return parts_->solver->patch_count();
}

SolveResult solve_radiosity(const std::shared_ptr<const TransferData>& data, SolveMethod method,
                            std::span<const Float3> initial_exitance, const SolveSettings& settings,
                            std::span<Float3> radiosity) {
  return Solver(data, method).solve(initial_exitance, settings, radiosity);
}

}  // namespace rebounce
