#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "rebounce/engine.h"
#include "runtime/solvers/solve_radiosity.h"
#include "transfer/exchange/form_factor_operator.h"

namespace rebounce {

/// How a frame computes its indirect light.
struct IndirectMethod {
  std::optional<SolveMethod> iteration{};  ///< unset: one product with the stored operator
  bool on_links = false;  ///< hierarchical radiosity over the file's links instead of either
  int sweeps = 1;         ///< sweeps of an iteration, at least 1
  bool warm = true;       ///< an iteration starts from the frame before
  /// The product on the graphics card, with direct light from the viewer's shadow maps; where that
  /// is not asked for the light, the product on the processor.
  bool on_card = false;

  bool iterates() const { return iteration || on_links; }
  bool operator==(const IndirectMethod&) const = default;
};

/// Computes the indirect light of a frame by any method. An iteration keeps its solution between
/// frames, and form factors in the form that is fastest for it (make_form_factors).
class IndirectSolver {
 public:
  /// `data` must have an operator and outlive the object.
  explicit IndirectSolver(const TransferData& data);

  /// Changes the method; a new iteration starts without a solution. Throws Error if it needs links
  /// and there are none.
  void choose(const IndirectMethod& method);
  const IndirectMethod& method() const { return method_; }

  /// H [n] in lx for `initial_exitance` [n] in lx; valid until the next call. Throws Error if the
  /// method cannot be used.
  std::span<const Float3> solve(std::span<const Float3> initial_exitance);

  /// Microseconds of the last solve. For an iteration, the final gather from radiosity to H is not
  /// counted.
  double microseconds() const { return microseconds_; }

 private:
  void make_iteration(const IndirectMethod& method);
  void apply(std::span<const Float3> initial_exitance);
  void iterate(std::span<const Float3> initial_exitance);

  const TransferData& data_;
  IndirectMethod method_;
  std::unique_ptr<const FormFactorOperator> form_factors_;  ///< for iterations
  std::unique_ptr<RadiositySolver> solver_;
  std::vector<Float3> indirect_irradiance_;
  std::vector<float> workspace_;
  double microseconds_ = 0;
};

}  // namespace rebounce
