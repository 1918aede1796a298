#pragma once

// All iterative methods by name, and solves in one call.

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "runtime/solvers/radiosity_solver.h"
#include "transfer/exchange/exchange_matrix.h"
#include "transfer/exchange/relaxation.h"
#include "transfer/file/transfer_data.h"
#include "transfer/operator/transfer_operator.h"

namespace rebounce {

constexpr bool needs_operator(SolveMethod method) {
  return method == SolveMethod::kRefine;
}

/// Sparse F in the form that is fastest for `method`: blocks of rows for sweeps in one direction,
/// otherwise blocks of the symmetric half. `area` has n entries in m². Throws Error if the sizes do
/// not agree.
std::unique_ptr<const SweepableFormFactors> make_form_factors(SolveMethod method,
                                                              const ExchangeMatrix& exchange,
                                                              std::span<const float> area);

/// Whether `data` hold F, by pairs or compressed.
bool has_form_factors(const TransferData& data);

/// The most accurate F in `data`: pairs, in the form above, or compressed if there are no pairs.
/// Throws Error, with the options that make a file that has some, if there is neither.
std::unique_ptr<const SweepableFormFactors> make_form_factors(SolveMethod method,
                                                              const TransferData& data);

/// F M_e [n] in lx: the irradiance directly from the scene's own emitters, as `data` hold it, as
/// their F gives it, or, to its error, their operator. Empty if nothing emits. Throws Error if
/// something does and there is neither, nor an operator that serves all patches.
std::vector<Float3> irradiance_from_emitters(const TransferData& data);

/// Makes a solver for `method`. `form_factors` must outlive it. `transfer` may be null for methods
/// that do not need it. Throws Error if sizes differ, if a needed operator is missing, or if the
/// method needs another form of F.
std::unique_ptr<RadiositySolver> make_solver(
    SolveMethod method, const FormFactorOperator& form_factors, const RadiosityProblem& problem,
    std::shared_ptr<const TransferOperator> transfer = nullptr);

/// Solves once, without a start solution, and writes the solution [n] in lx to `radiosity`.
/// Allocates; keep a solver for repeated solves. Throws Error as make_solver and
/// RadiositySolver::solve do.
SolveResult solve_radiosity(SolveMethod method, const FormFactorOperator& form_factors,
                            const RadiosityProblem& problem,
                            std::span<const Float3> initial_exitance, const SolveSettings& settings,
                            std::span<Float3> radiosity,
                            std::shared_ptr<const TransferOperator> transfer = nullptr);

}  // namespace rebounce
