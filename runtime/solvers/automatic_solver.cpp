#include "rebounce/runtime/automatic_solver.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <utility>

#include "rebounce/transfer/area_norm.h"
#include "rebounce/transfer/error.h"
#include "rebounce/transfer/hierarchical_operator.h"
#include "rebounce/transfer/reflection.h"

namespace rebounce {
namespace {

// Time per byte read, in units of that of a hierarchical operator in halves or 16 bits: in bytes
// there are more values to each; a dense one is nothing but reading; F is one matrix for three
// channels, so that each byte is worked with three times. Measured by ./dev report, as are the next
// ones.
constexpr double kBytesWork = 1.3, kDenseWork = 0.4, kGatherWork = 2;

// Symmetric Gauss-Seidel and conjugate gradients in gathers: what a warm start costs, and a sweep.
constexpr double kGaussSeidelStart = 0.65, kGaussSeidelSweep = 0.65;
constexpr double kConjugateGradientStart = 2.1, kConjugateGradientSweep = 1.05;

/// Sweeps that shrink an error by `factor` each from `from` to `to`; at least one.
double sweeps_needed(double from, double to, double factor) {
  if (from <= to) return 1;
  factor = std::clamp(factor, 1e-6, 1 - 1e-6);
  return std::max(1.0, std::ceil(std::log(to / from) / std::log(factor)));
}

// What is reflected can be less than rho / (1 - rho) of M0: where much light escapes, or lamps have
// colours of their own.
constexpr double kCaution = 0.5;

/// Means over the surface.
struct MeanReflectance {
  double brightest = 0;  ///< of each patch's brightest channel
  double all = 0;        ///< of all channels
};

MeanReflectance mean_reflectance(std::span<const Float3> reflectance, std::span<const float> area) {
  MeanReflectance mean;
  double total = 0;
  for (std::size_t i = 0; i < area.size(); ++i) {
    const Float3& rho = reflectance[i];
    mean.brightest += static_cast<double>(area[i]) * std::ranges::max(rho);
    mean.all += static_cast<double>(area[i]) * (rho[0] + rho[1] + rho[2]) / kChannelCount;
    total += area[i];
  }
  if (total == 0) return {};
  return {mean.brightest / total, mean.all / total};
}

/// One that does not is of no use for a solution on all patches.
bool serves_all(const std::shared_ptr<const TransferOperator>& transfer) {
  return transfer != nullptr && transfer->roles().all_are_both();
}

double product_cost(const TransferOperator* transfer) {
  if (transfer == nullptr) return 0;
  const auto bytes = static_cast<double>(transfer->bytes());
  const auto* hierarchical = dynamic_cast<const HierarchicalOperator*>(transfer);
  if (hierarchical && hierarchical->storage().precision == Precision::kQ8) {
    return kBytesWork * bytes;
  }
  return transfer->kind() == "dense" ? kDenseWork * bytes : bytes;
}

}  // namespace

std::string_view name(AutomaticMethod method) {
  switch (method) {
    case AutomaticMethod::kTransfer:
      return "transfer";
    case AutomaticMethod::kRefine:
      return "refine";
    case AutomaticMethod::kGaussSeidel:
      return "symmetric-gauss-seidel";
    case AutomaticMethod::kConjugateGradient:
      break;
  }
  return "conjugate-gradient";
}

AutomaticMethod choose_method(const MethodCosts& costs, double change, double error) {
  // Gauss-Seidel shrinks an error by about the square of the reflectance, two bounces a sweep;
  // conjugate gradients by what their theory says of eigenvalues in [1 - rho, 1 + rho].
  const double rho = costs.reflectance;
  const double root = std::sqrt((1 + rho) / (1 - rho));
  const double gauss_seidel = sweeps_needed(change, error, rho * rho);
  const double conjugate_gradient = sweeps_needed(change, error, (root - 1) / (root + 1));
  struct Choice {
    AutomaticMethod method;
    double cost;
  };
  std::array<Choice, 4> choices;
  std::size_t count = 0;
  if (costs.operator_error <= error) {
    choices[count++] = {AutomaticMethod::kTransfer, costs.product};
  } else if (costs.operator_error < 1) {
    choices[count++] = {
        AutomaticMethod::kRefine,
        (costs.product + costs.gather) * sweeps_needed(1, error, costs.operator_error)};
  }
  choices[count++] = {AutomaticMethod::kGaussSeidel,
                      costs.gather * (kGaussSeidelStart + kGaussSeidelSweep * gauss_seidel)};
  choices[count++] = {
      AutomaticMethod::kConjugateGradient,
      costs.gather * (kConjugateGradientStart + kConjugateGradientSweep * conjugate_gradient)};
  return std::min_element(choices.begin(), choices.begin() + static_cast<std::ptrdiff_t>(count),
                          [](const Choice& a, const Choice& b) { return a.cost < b.cost; })
      ->method;
}

AutomaticSolver::AutomaticSolver(const SweepableFormFactors& form_factors,
                                 const RadiosityProblem& problem,
                                 std::shared_ptr<const TransferOperator> transfer,
                                 double transfer_error)
    : area_(problem.area.begin(), problem.area.end()),
      reflectance_(problem.reflectance.begin(), problem.reflectance.end()),
      transfer_(serves_all(transfer) ? std::move(transfer) : nullptr),
      gauss_seidel_(form_factors, problem, SweepOrder::kSymmetric),
      conjugate_gradient_(form_factors, problem),
      costs_{.product = product_cost(transfer_.get()),
             .gather = kGatherWork * static_cast<double>(form_factors.bytes()),
             .operator_error = transfer_ ? transfer_error : 1,
             .reflectance = mean_reflectance(reflectance_, area_).brightest},
      residual_per_error_(kCaution * mean_reflectance(reflectance_, area_).all),
      radiosity_(area_.size()),
      last_exitance_(area_.size()) {
  if (!transfer_) return;
  refinement_ = std::make_unique<RefinementSolver>(form_factors, problem, transfer_);
  workspace_.resize(transfer_->workspace_size());
}

void AutomaticSolver::set_reflectance(std::span<const Float3> reflectance) {
  gauss_seidel_.set_reflectance(reflectance);
  conjugate_gradient_.set_reflectance(reflectance);
  reflectance_.assign(reflectance.begin(), reflectance.end());
  const MeanReflectance mean = mean_reflectance(reflectance_, area_);
  costs_.reflectance = mean.brightest;
  residual_per_error_ = kCaution * mean.all;
  costs_.operator_error = 1;
  repainted_ = true;
}

double AutomaticSolver::change_of(std::span<const Float3> initial_exitance) const {
  if (!known_ || repainted_) return 1;
  return std::min(1.0, relative_difference(last_exitance_, initial_exitance, area_));
}

void AutomaticSolver::multiply(std::span<const Float3> initial_exitance) {
  transfer_->apply(initial_exitance, radiosity_, workspace_);
  add_reflected(initial_exitance, reflectance_, radiosity_, radiosity_);
}

RadiositySolver& AutomaticSolver::solver_for(AutomaticMethod method) {
  if (method == AutomaticMethod::kRefine) return *refinement_;
  if (method == AutomaticMethod::kGaussSeidel) return gauss_seidel_;
  return conjugate_gradient_;
}

int AutomaticSolver::iterate(AutomaticMethod method, std::span<const Float3> initial_exitance,
                             double error, int max_sweeps) {
  RadiositySolver& solver = solver_for(method);
  if (known_ && method != AutomaticMethod::kRefine) {
    solver.start_from(radiosity_);
  } else {
    solver.forget();
  }
  // A residual leaves an error of 1 / (1 - rho) of it, and rho / (1 - rho) is what is reflected.
  const SolveSettings settings{
      .max_sweeps = max_sweeps, .residual = error * residual_per_error_, .measure_residual = false};
  return solver.solve(initial_exitance, settings, radiosity_).sweeps;
}

AutomaticSolver::Result AutomaticSolver::solve(std::span<const Float3> initial_exitance,
                                               double error, int max_sweeps) {
  const auto begin = std::chrono::steady_clock::now();
  if (initial_exitance.size() != area_.size()) {
    throw Error("solver: the initial exitance must have one entry per patch");
  }
  if (!(error > 0)) throw Error("solver: the error that may be left must be above 0");
  Result result;
  result.method = choose_method(costs_, change_of(initial_exitance), error);
  if (result.method == AutomaticMethod::kTransfer) {
    multiply(initial_exitance);
  } else {
    result.sweeps = iterate(result.method, initial_exitance, error, max_sweeps);
  }
  std::ranges::copy(initial_exitance, last_exitance_.begin());
  known_ = true;
  repainted_ = false;
  result.microseconds =
      std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace rebounce
