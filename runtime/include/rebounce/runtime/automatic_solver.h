#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "rebounce/runtime/conjugate_gradient_solver.h"
#include "rebounce/runtime/gauss_seidel_solver.h"
#include "rebounce/runtime/refinement_solver.h"
#include "rebounce/transfer/relaxation.h"
#include "rebounce/transfer/transfer_operator.h"

namespace rebounce {

/// What an AutomaticSolver can choose.
enum class AutomaticMethod : std::uint8_t {
  kTransfer,           ///< one product with the stored operator
  kRefine,             ///< the product, made more exact with F
  kGaussSeidel,        ///< symmetric, from the solution before
  kConjugateGradient,  ///< from the solution before
};

/// As the command line names it: "transfer", "refine", "symmetric-gauss-seidel",
/// "conjugate-gradient".
std::string_view name(AutomaticMethod method);

/// What is known of a scene before a choice.
struct MethodCosts {
  /// Time of a product with the operator and of a gather with F, in any one unit.
  double product = 0, gather = 0;
  /// Error of the light that the operator gives, relative, area-weighted L2; at least 1: it is of
  /// no use, or there is none.
  double operator_error = 1;
  double reflectance = 0;  ///< mean over the surface, of the brightest channel, below 1
};

/// Chooses the cheapest method that brings the reflected light's error to `error` (above 0) when
/// `change` is the part of M0 that is new: 1 from nothing. The rule and what it was measured on:
/// notes/solvers.md.
AutomaticMethod choose_method(const MethodCosts& costs, double change, double error);

/// Solves each frame by the method that takes least for the change of the light and for the error
/// that may be left: a product with the stored operator, that product refined, or sweeps from the
/// last solution. The choice is made from sizes and light, never from a clock: the same calls give
/// the same bits.
///
/// Belongs to one thread at a time; after construction nothing allocates.
class AutomaticSolver {
 public:
  /// `form_factors` must outlive the solver. `transfer` may be null, and is not used if it does not
  /// serve all patches; its `transfer_error` is that of BuildRecord::error_mean. Throws Error if
  /// sizes differ.
  AutomaticSolver(const SweepableFormFactors& form_factors, const RadiosityProblem& problem,
                  std::shared_ptr<const TransferOperator> transfer, double transfer_error);

  struct Result {
    AutomaticMethod method = AutomaticMethod::kTransfer;
    int sweeps = 0;           ///< 0: one product
    double microseconds = 0;  ///< with the choice
  };

  /// Solves for `initial_exitance` M0 [n] in lx, to about `error` of the light that is reflected
  /// after arriving from other patches: relative, area-weighted L2, > 0. Iterations stop after
  /// `max_sweeps`. Throws Error if a size or a setting is wrong.
  Result solve(std::span<const Float3> initial_exitance, double error, int max_sweeps = 100);

  /// The last solution B [n] in lx; valid until the next solve.
  std::span<const Float3> radiosity() const { return radiosity_; }

  /// Takes other reflectances [n] from the next solve on. The operator is of no use any more.
  /// Throws Error as RadiositySolver::set_reflectance does.
  void set_reflectance(std::span<const Float3> reflectance);

  /// The next solve starts from nothing.
  void forget() { known_ = false; }

 private:
  double change_of(std::span<const Float3> initial_exitance) const;
  void multiply(std::span<const Float3> initial_exitance);
  int iterate(AutomaticMethod method, std::span<const Float3> initial_exitance, double error,
              int max_sweeps);
  RadiositySolver& solver_for(AutomaticMethod method);

  std::vector<float> area_;
  std::vector<Float3> reflectance_;
  std::shared_ptr<const TransferOperator> transfer_;
  std::unique_ptr<RefinementSolver> refinement_;  ///< if there is an operator
  GaussSeidelSolver gauss_seidel_;
  ConjugateGradientSolver conjugate_gradient_;
  MethodCosts costs_;
  double residual_per_error_;  ///< residuals are parts of M0, errors of what is reflected

  bool known_ = false;      ///< radiosity_ is of last_exitance_
  bool repainted_ = false;  ///< and of other reflectances
  std::vector<Float3> radiosity_, last_exitance_;
  std::vector<float> workspace_;
};

}  // namespace rebounce
