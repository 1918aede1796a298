#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bench/report/contenders.h"
#include "runtime/solvers/solve_radiosity.h"

namespace rebounce::bench {

/// A way to find B for M0, which keeps its last solution as an engine would.
class Method {
 public:
  virtual ~Method() = default;

  /// Finds the radiosity for `initial_exitance` [n] in lx, by `sweeps` sweeps where it iterates; by
  /// fewer where it believes the residual to be below `residual` (SolveSettings) before, or where
  /// single precision reaches no further. Returns how many it made; a product makes none.
  virtual int run(std::span<const Float3> initial_exitance, int sweeps, double residual) = 0;
  int run(std::span<const Float3> initial_exitance, int sweeps) {
    return run(initial_exitance, sweeps, 0);
  }

  /// The same, and calls `monitor` after each sweep, or the product; false ends the run.
  virtual void watch(std::span<const Float3> initial_exitance, int sweeps,
                     const RadiositySolver::Monitor& monitor) = 0;

  /// The last solution [n] in lx; valid until the next run.
  virtual std::span<const Float3> radiosity() const = 0;

  virtual bool iterates() const = 0;
  virtual void reset() = 0;
  virtual void start_from(std::span<const Float3> radiosity) = 0;
  virtual void set_reflectance(std::span<const Float3> reflectance) = 0;
};

inline constexpr const char* kDenseInverse = "dense inverse";

/// How to make one, and what it is called in the report.
struct Contestant {
  std::string name;        ///< "inverse", "low rank", "refine", "gauss-seidel"...
  std::string transfer{};  ///< which operator it has; empty: none
  std::string form{};      ///< which form of F it has; empty: none
  std::size_t bytes = 0;   ///< of them
  /// That a product or a sweep reads of them; what is read twice counts twice.
  std::size_t bytes_read = 0;
  /// That the start of a run reads of them beside its sweeps.
  std::size_t bytes_of_cold_start = 0, bytes_of_warm_start = 0;

  /// Of the named method; `product`: one product with the operator instead.
  SolveMethod method = SolveMethod::kGathering;
  bool product = false;

  std::unique_ptr<Method> make(const Contenders& contenders) const;
};

/// Every method on every form that it can use.
std::vector<Contestant> list_contestants(const Contenders& contenders,
                                         const ReportSettings& settings);

}  // namespace rebounce::bench
