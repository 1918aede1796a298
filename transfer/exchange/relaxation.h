#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "transfer/base/types.h"
#include "transfer/exchange/form_factor_operator.h"

namespace rebounce {

/// The system (I - rho F) B = M0 without F. The spans are by patch and outlive the sweeps.
struct RelaxationProblem {
  std::span<const float> area;               ///< [n] m², > 0
  std::span<const Float3> reflectance;       ///< [n] 0 <= rho < 1
  std::span<const Float3> initial_exitance;  ///< [n] M0 in lx
};

enum class SweepOrder : std::uint8_t {
  kForward,    ///< patches in their order: Gauss-Seidel
  kSymmetric,  ///< by turns in their order and against it: symmetric Gauss-Seidel
};

enum class SweepDirection : std::uint8_t { kForward, kBackward };

/// Gauss-Seidel sweeps over one form of F: B(i) = M0(i) + rho(i) sum over j of F(i,j) B(j), patch
/// after patch, in an order of that form's own. It keeps what a sweep needs and refers to F, which
/// must outlive it; it belongs to one thread at a time. Neither begin, sweep nor end allocates, and
/// the bits do not depend on the scheduler.
class Relaxation {
 public:
  virtual ~Relaxation() = default;

  /// Goes on from `radiosity` [n] in lx with the present light and reflectances.
  virtual void begin(const RelaxationProblem& problem, std::span<const Float3> radiosity) = 0;

  /// One sweep over all patches. Returns the square of what it changed, area-weighted, all
  /// channels: each patch's change was its residual when it was reached.
  virtual double sweep(SweepDirection direction, const Scheduler& scheduler = {}) = 0;

  /// Writes the radiosity [n] in lx after the last sweep.
  virtual void end(std::span<Float3> radiosity) const = 0;

  /// How often one sweep reads all of F, on average.
  virtual int reads_per_sweep(SweepOrder order) const = 0;
};

/// F that Gauss-Seidel can sweep over as well.
class SweepableFormFactors : public FormFactorOperator {
 public:
  /// Sweeps over this F; they start with Relaxation::begin. Allocates what they need.
  virtual std::unique_ptr<Relaxation> make_relaxation() const = 0;
};

}  // namespace rebounce
