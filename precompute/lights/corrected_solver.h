#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "precompute/lights/solve_batches.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The indirect irradiances [n] in lx of lights, given as initial exitances [n] in lx, by an
/// operator. Threads share the lights.
std::vector<std::vector<Float3>> indirect_irradiances(
    const TransferOperator& transfer, std::span<const std::vector<Float3>> initial_exitances);

/// Finds the light of links by iterative refinement (J. H. Wilkinson, "Rounding errors in algebraic
/// processes", 1963). A first guess is off by some thousandths. One gather along the links tells
/// the residual, and the nearly exact light of the residual is the correction. Each round takes the
/// error to a part of itself that is about as large as that of the guess, so that one is enough
/// where conjugate gradients along the links gather three times. The few lights for which it is
/// not, for instance of lamps in nooks, are left to ReferenceSolver.
class CorrectedSolver {
 public:
  using Lights = std::vector<std::vector<Float3>>;  ///< [lights][n]

  /// Guess and corrections are `nearly_exact`: those of an operator, of compressed form factors or
  /// of fewer links. `patches`, and what `nearly_exact` refers to, must outlive the object.
  CorrectedSolver(IrradiancesOf nearly_exact, std::shared_ptr<const LinkedFormFactors> links,
                  const PatchTable& patches)
      : nearly_exact_(std::move(nearly_exact)), links_(std::move(links)), patches_(patches) {}

  /// How far light may be off, as the last correction lets expect. The larger of two limits holds.
  struct Accuracy {
    double of_light;      ///< relative to the light
    double of_guess = 0;  ///< relative to the error of its guess
  };

  /// The indirect irradiances of `initial_exitances` by the links, in lx; gathers in single
  /// precision. All ranks call it together. The bits do not depend on threads or ranks.
  Lights indirect_irradiances(std::span<const std::vector<Float3>> initial_exitances,
                              const Accuracy& accuracy) const;

 private:
  /// A light that is still to be solved for.
  struct Open {
    std::size_t light;   ///< its place among all
    double last_change;  ///< area norm of what the last round has changed
    double guess_error;  ///< area norm of what the first round has changed
  };

  Lights gather(const Lights& radiosities) const;
  Lights correct(std::span<const std::vector<Float3>> initial_exitances, const Lights& irradiances,
                 std::span<const Open> open) const;
  void solve_along_links(std::span<const std::vector<Float3>> initial_exitances,
                         std::span<const Open> open, double residual, Lights& irradiances) const;

  IrradiancesOf nearly_exact_;
  std::shared_ptr<const LinkedFormFactors> links_;
  const PatchTable& patches_;
};

}  // namespace rebounce
