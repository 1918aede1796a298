#pragma once

#include <chrono>
#include <functional>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "rebounce/solvers.h"
#include "rebounce/types.h"
#include "transfer/exchange/form_factor_operator.h"

namespace rebounce {

/// The system (I - rho F) B = M0, without M0 and F.
struct RadiosityProblem {
  std::span<const float> area;          ///< [n] m², > 0
  std::span<const Float3> reflectance;  ///< [n] 0 <= rho < 1
};

/// An iterative method that keeps its last solution and starts the next solve from it.
///
/// A solver copies areas and reflectances and refers to the form factors, which must outlive it. It
/// belongs to one thread at a time and gives the same bits for any scheduler. After construction it
/// does not allocate.
class RadiositySolver {
 public:
  virtual ~RadiositySolver() = default;
  RadiositySolver(const RadiositySolver&) = delete;
  RadiositySolver& operator=(const RadiositySolver&) = delete;

  /// Solves for `initial_exitance` M0 = rho E + Me [n] in lx, starting from the last solution.
  /// Throws Error if its size or a setting is wrong, or a number of it is negative or not finite;
  /// and, after a reset(), if the solution is not finite.
  SolveResult solve(std::span<const Float3> initial_exitance, const SolveSettings& settings = {});

  /// Does the same and copies the solution [n] in lx to `radiosity`.
  SolveResult solve(std::span<const Float3> initial_exitance, const SolveSettings& settings,
                    std::span<Float3> radiosity);

  /// Called after each sweep of a solve with the solution B [n] in lx so far; false ends the solve.
  using Monitor = std::function<bool(std::span<const Float3>)>;

  /// Sets it for all further solves; an empty one calls nothing.
  void set_monitor(Monitor monitor) { monitor_ = std::move(monitor); }

  /// The last solution B [n] in lx; valid until the next solve.
  std::span<const Float3> radiosity() const { return radiosity_; }

  /// Changes the reflectances [n] from the next solve on. M0 must be computed with the same
  /// reflectances. Throws Error if the size is wrong or one is not in [0, 1).
  void set_reflectance(std::span<const Float3> reflectance);

  /// The next solve starts from `radiosity` [n] in lx. Throws Error if the size is wrong or a
  /// number is not finite.
  void start_from(std::span<const Float3> radiosity);

  /// The next solve starts without a solution.
  void reset();

  std::size_t patch_count() const { return area_.size(); }

 protected:
  RadiositySolver(const FormFactorOperator& form_factors, const RadiosityProblem& problem);

  /// Prepares the iteration from radiosity_. `cold`: there is no earlier solution, and radiosity_
  /// is M0.
  virtual void begin(bool cold) = 0;

  struct SweepReport {
    double residual = 0;    ///< norm of the residual, or a bound of it
    bool measured = false;  ///< `residual` is the norm of M0 + rho F B - B for the current B
    bool stuck = false;     ///< another sweep would change nothing
    bool diverged = false;  ///< this sweep increased the residual and was undone
  };

  /// One sweep; it costs about one gather.
  virtual SweepReport sweep() = 0;

  /// Brings radiosity_ up to date with the iteration.
  virtual void finish() {}

  /// residual_ = M0 + rho F B - B; returns its norm. Costs one gather.
  double compute_residual();

  const FormFactorOperator& form_factors_;
  std::vector<float> area_;
  std::vector<Float3> reflectance_;
  float max_reflectance_ = 0;
  std::span<const Float3> initial_exitance_;  ///< during a solve
  Scheduler scheduler_;                       ///< during a solve
  std::vector<Float3> radiosity_, residual_;
  std::vector<float> gather_workspace_;

 private:
  using Clock = std::chrono::steady_clock;

  SolveResult iterate(const SolveSettings& settings, Clock::time_point start);
  bool monitor_ends();
  void check(std::span<const Float3> initial_exitance, const SolveSettings& settings) const;
  void refuse_if_not_finite(const SolveResult& result);

  bool cold_ = true;
  Monitor monitor_;
  Clock::time_point deadline_ = Clock::time_point::max();
};

}  // namespace rebounce
