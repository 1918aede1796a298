#pragma once

// Iterative solutions of the radiosity system (I - rho F) B = M0 with the form factors of a
// transfer file, for light that is more exact than the stored operator's, and for
// comparison. notes/concepts/solvers.md explains the methods.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "rebounce/scheduler.h"
#include "rebounce/transfer_file.h"
#include "rebounce/types.h"

namespace rebounce {

enum class SolveMethod : std::uint8_t {
  kGathering,
  kJacobi,                ///< the same iteration as kGathering
  kGaussSeidel,           ///< of pairs or compressed form factors, not of links
  kSymmetricGaussSeidel,  ///< likewise
  kConjugateGradient,
  kRefine,  ///< needs a stored operator that serves all patches
};

struct NamedSolveMethod {
  std::string_view name;  ///< name on the command line
  SolveMethod method;
};

inline constexpr std::array<NamedSolveMethod, 6> kSolveMethods = {{
    {"gathering", SolveMethod::kGathering},
    {"jacobi", SolveMethod::kJacobi},
    {"gauss-seidel", SolveMethod::kGaussSeidel},
    {"symmetric-gauss-seidel", SolveMethod::kSymmetricGaussSeidel},
    {"conjugate-gradient", SolveMethod::kConjugateGradient},
    {"refine", SolveMethod::kRefine},
}};

/// The form factors of a file that a method gathers with.
enum class FormFactorSource : std::uint8_t {
  kBest,        ///< exact ones where there are any, else compressed ones
  kExact,       ///< of pairs of patches
  kCompressed,  ///< as blocks of low rank
  kLinks,       ///< gathering over links is hierarchical radiosity; not for Gauss-Seidel
};

/// When an iterative method stops (at the first limit that it reaches), and where its loops run.
/// See notes/concepts/solvers.md for the methods.
struct SolveSettings {
  int max_sweeps = 100;  ///< at least 1; more: closer to the solution, longer
  /// Stop when |M0 + rho F B - B| / |M0| (area-weighted L2) is at most this. 0: only sweeps and
  /// time count. Single precision reaches about 1e-7 |B| / |M0|; a solve that no longer improves
  /// stops.
  double residual = 1e-6;
  double time_budget_microseconds = 0;  ///< no new sweep after this time; 0: no limit
  /// Measure the residual of the result. `false` saves one gather; the result then has the method's
  /// own bound.
  bool measure_residual = true;
  Scheduler scheduler{};  ///< where the loops of the solve run
};

struct SolveResult {
  int sweeps = 0;
  double residual = 0;      ///< |M0 + rho F B - B| / |M0|, area-weighted L2 over all channels
  bool converged = false;   ///< the requested residual is reached
  bool diverged = false;    ///< the residual grew; the result is the best solution found
  double microseconds = 0;  ///< without the final measurement of the residual
};

/// A method with the form factors of one transfer file, made once, that keeps its last solution and
/// starts the next solve from it.
///
/// It belongs to one thread at a time and gives the same bits for any scheduler. After construction
/// nothing allocates. A solver that was moved from may only be destroyed.
class Solver {
 public:
  /// Throws Error if `data` is null or has not the form factors or the operator that this takes.
  Solver(std::shared_ptr<const TransferData> data, SolveMethod method,
         FormFactorSource source = FormFactorSource::kBest);
  ~Solver();
  Solver(Solver&&) noexcept;
  Solver& operator=(Solver&&) noexcept;

  /// Solves for `initial_exitance` M0 = rho E + Me [n] in lx, from the last solution. Throws Error
  /// if its size or a setting is wrong, or a number of it is negative or not finite; the last
  /// solution then stays. Throws Error too if the solution is not finite, as where light comes
  /// close to the largest float or a method diverges; the next solve then starts from nothing.
  SolveResult solve(std::span<const Float3> initial_exitance, const SolveSettings& settings = {});

  /// The same, and copies the solution [n] in lx to `radiosity`.
  SolveResult solve(std::span<const Float3> initial_exitance, const SolveSettings& settings,
                    std::span<Float3> radiosity);

  /// The last solution B [n] in lx; valid until the next solve.
  std::span<const Float3> radiosity() const;

  /// Sets other reflectances [n], exactly, from the next solve on; M0 must be computed with them
  /// too. Throws Error if the size is wrong or one is not in [0, 1).
  void set_reflectance(std::span<const Float3> reflectance);

  /// The next solve starts from `radiosity` [n] in lx. Throws Error if the size is wrong or a
  /// number is not finite.
  void start_from(std::span<const Float3> radiosity);

  /// The next solve starts from nothing.
  void reset();

  std::size_t patch_count() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// How far an indirect irradiance is from the solution with the form factors of a file, relative to
/// that solution in the area-weighted L2 norm over all patches and channels.
struct ErrorEstimate {
  double error = 0;  ///< off by about the error of the operator, relative to itself
  /// The error is at most this, but for rounding in single precision, some 1e-6. Infinite if too
  /// little light arrives to tell. It is close to `error` unless reflectances come close to 1.
  double bound = 0;
};

/// Finds the error of frames from their residuals, with the form factors of a transfer file: two
/// gathers and a product with the operator for each frame. What errs in the form factors
/// themselves, such as their own compression, is no part of it. See notes/concepts/errors.md.
///
/// It belongs to one thread at a time and gives the same bits for any scheduler. After construction
/// nothing allocates. An estimator that was moved from may only be destroyed.
class ErrorEstimator {
 public:
  /// Throws Error if `data` is null, has no form factors of this source, no operator, or one that
  /// does not serve all patches.
  explicit ErrorEstimator(std::shared_ptr<const TransferData> data,
                          FormFactorSource source = FormFactorSource::kBest);
  ~ErrorEstimator();
  ErrorEstimator(ErrorEstimator&&) noexcept;
  ErrorEstimator& operator=(ErrorEstimator&&) noexcept;

  /// The error of `indirect_irradiance` H [n] in lx under `initial_exitance` M0 = rho E + Me [n] in
  /// lx: those of an Engine, for instance. Throws Error if a size is wrong, an exitance is negative
  /// or not finite, or an irradiance is not finite.
  ErrorEstimate estimate_error(std::span<const Float3> initial_exitance,
                               std::span<const Float3> indirect_irradiance,
                               const Scheduler& scheduler = {});

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Solves once, from nothing, and writes the solution [n] in lx to `radiosity`. Makes a Solver:
/// keep one for more than one solve. Throws Error as that does.
SolveResult solve_radiosity(const std::shared_ptr<const TransferData>& data, SolveMethod method,
                            std::span<const Float3> initial_exitance, const SolveSettings& settings,
                            std::span<Float3> radiosity);

}  // namespace rebounce
