#include "runtime/solvers/solve_radiosity.h"

#include <algorithm>

#include "rebounce/error.h"
#include "runtime/solvers/conjugate_gradient_solver.h"
#include "runtime/solvers/gathering_solver.h"
#include "runtime/solvers/gauss_seidel_solver.h"
#include "runtime/solvers/refinement_solver.h"
#include "transfer/exchange/compressed_form_factors.h"
#include "transfer/exchange/exchange_blocks.h"
#include "transfer/exchange/form_factor_blocks.h"

namespace rebounce {
namespace {

const SweepableFormFactors& sweepable(const FormFactorOperator& form_factors) {
  const auto* form = dynamic_cast<const SweepableFormFactors*>(&form_factors);
  if (form == nullptr) {
    throw Error(
        "solver: gauss-seidel cannot sweep over these form factors; take gathering or "
        "conjugate-gradient");
  }
  return *form;
}

/// Gathers -Y x. With -Y in the place of F the system is (I + rho Y) B = M0, and since
/// I + rho Y = (I - rho F)^-1, its solution is M0 - rho F M0.
class NegatedTransfer final : public FormFactorOperator {
 public:
  explicit NegatedTransfer(const TransferOperator& transfer) : transfer_(transfer) {}

  std::size_t patch_count() const override { return transfer_.patch_count(); }
  std::size_t bytes() const override { return transfer_.bytes(); }
  std::size_t workspace_size() const override { return transfer_.workspace_size(); }

 private:
  void do_gather(std::span<const Float3> in, std::span<Float3> out, std::span<float> workspace,
                 const Scheduler& scheduler) const override {
    transfer_.apply(in, out, workspace, scheduler);
    for (Float3& value : out) value = {-value[0], -value[1], -value[2]};
  }

  const TransferOperator& transfer_;
};

/// F M by the operator alone, to its error: Y (M - rho F M) = F M.
std::vector<Float3> gather_by_operator(const TransferOperator& transfer, const PatchTable& patches,
                                       std::span<const Float3> exitance) {
  std::vector<Float3> rest(exitance.size());
  solve_radiosity(SolveMethod::kConjugateGradient, NegatedTransfer(transfer),
                  {patches.area, patches.reflectance}, exitance, {.residual = 1e-4}, rest);
  return product(transfer, rest);
}

}  // namespace

std::unique_ptr<const SweepableFormFactors> make_form_factors(SolveMethod method,
                                                              const ExchangeMatrix& exchange,
                                                              std::span<const float> area) {
  if (method == SolveMethod::kGaussSeidel) {
    return std::make_unique<FormFactorBlocks>(exchange, area);
  }
  return std::make_unique<ExchangeBlocks>(exchange, area);
}

bool has_form_factors(const TransferData& data) {
  return !data.exchange.empty() || data.compressed_form_factors;
}

std::unique_ptr<const SweepableFormFactors> make_form_factors(SolveMethod method,
                                                              const TransferData& data) {
  if (!has_form_factors(data)) {
    throw Error(
        "the transfer file has no form factors; make it again with precompute "
        "--store-form-factors or --compress-form-factors");
  }
  if (!data.exchange.empty()) return make_form_factors(method, data.exchange, data.patches.area);
  return std::make_unique<CompressedFormFactors>(data.compressed_form_factors);
}

std::vector<Float3> irradiance_from_emitters(const TransferData& data) {
  if (!data.emitted_irradiance.empty()) return data.emitted_irradiance;
  const std::vector<Float3>& emitted = data.patches.emitted_exitance;
  if (std::ranges::all_of(emitted, [](const Float3& m) { return m == Float3{}; })) return {};
  if (!has_form_factors(data) && data.transfer && data.transfer->roles().all_are_both()) {
    return gather_by_operator(*data.transfer, data.patches, emitted);
  }
  return gather(*make_form_factors(SolveMethod::kGathering, data), emitted);
}

std::unique_ptr<RadiositySolver> make_solver(SolveMethod method,
                                             const FormFactorOperator& form_factors,
                                             const RadiosityProblem& problem,
                                             std::shared_ptr<const TransferOperator> transfer) {
  switch (method) {
    case SolveMethod::kGathering:
    case SolveMethod::kJacobi:
      return std::make_unique<GatheringSolver>(form_factors, problem);
    case SolveMethod::kGaussSeidel:
      return std::make_unique<GaussSeidelSolver>(sweepable(form_factors), problem,
                                                 SweepOrder::kForward);
    case SolveMethod::kSymmetricGaussSeidel:
      return std::make_unique<GaussSeidelSolver>(sweepable(form_factors), problem,
                                                 SweepOrder::kSymmetric);
    case SolveMethod::kConjugateGradient:
      return std::make_unique<ConjugateGradientSolver>(form_factors, problem);
    case SolveMethod::kRefine:
      return std::make_unique<RefinementSolver>(form_factors, problem, std::move(transfer));
  }
  throw Error("solver: no such method");
}

SolveResult solve_radiosity(SolveMethod method, const FormFactorOperator& form_factors,
                            const RadiosityProblem& problem,
                            std::span<const Float3> initial_exitance, const SolveSettings& settings,
                            std::span<Float3> radiosity,
                            std::shared_ptr<const TransferOperator> transfer) {
  return make_solver(method, form_factors, problem, std::move(transfer))
      ->solve(initial_exitance, settings, radiosity);
}

}  // namespace rebounce
