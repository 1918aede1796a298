#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "rebounce/types.h"
#include "transfer/exchange/form_factor_operator.h"

namespace rebounce {

/// The system (I - rho F) B = M0 without F. The arrays are by patch and must outlive the sweeps.
struct RelaxationProblem {
  std::span<const float> area;               ///< [n] m², > 0
  std::span<const Float3> reflectance;       ///< [n] 0 <= rho < 1
  std::span<const Float3> initial_exitance;  ///< [n] M0 in lx
};

enum class SweepOrder : std::uint8_t {
  kForward,    ///< patches in their order: Gauss-Seidel
  kSymmetric,  ///< alternately in their order and in reverse: symmetric Gauss-Seidel
};

enum class SweepDirection : std::uint8_t { kForward, kBackward };

/// Gauss-Seidel sweeps over one form of F: B(i) = M0(i) + rho(i) sum over j of F(i,j) B(j), patch
/// after patch, in the order that suits this form. Owns its workspace and refers to F, which must
/// outlive it. Belongs to one thread at a time. begin, sweep and end do not allocate. Gives the
/// same bits for any scheduler.
class Relaxation {
 public:
  virtual ~Relaxation() = default;

  /// Starts from `radiosity` [n] in lx with the light and the reflectances of `problem`.
  virtual void begin(const RelaxationProblem& problem, std::span<const Float3> radiosity) = 0;

  /// One sweep over all patches. Returns the area-weighted square of the changes over all channels.
  /// The change of a patch is its residual just before it is relaxed.
  virtual double sweep(SweepDirection direction, const Scheduler& scheduler = {}) = 0;

  /// Writes the radiosity [n] in lx after the last sweep.
  virtual void end(std::span<Float3> radiosity) const = 0;

  /// How often a sweep reads all of F, on average.
  virtual int reads_per_sweep(SweepOrder order) const = 0;
};

/// F that also supports Gauss-Seidel sweeps.
class SweepableFormFactors : public FormFactorOperator {
 public:
  /// Makes sweeps over this F, which must outlive them. They start with Relaxation::begin.
  /// Allocates.
  virtual std::unique_ptr<Relaxation> make_relaxation() const = 0;
};

}  // namespace rebounce
