#pragma once

#include <cstdint>
#include <vector>

#include "rebounce/runtime/radiosity_solver.h"
#include "rebounce/transfer/form_factor_blocks.h"

namespace rebounce {

enum class SweepOrder : std::uint8_t {
  kForward,    ///< patches in their order: Gauss-Seidel
  kSymmetric,  ///< by turns in their order and against it: symmetric Gauss-Seidel
};

/// Gauss-Seidel relaxation (seed, chapter 8): patch after patch,
/// B(i) = M0(i) + rho(i) sum over j of F(i,j) B(j), always with the newest values.
///
/// It is the sequential method, to the letter, on any number of threads: rows are taken in groups
/// of FormFactorBlocks::kGroup; what they gather from outside the group is found in parallel, what
/// they gather from each other one after another. That costs two synchronisations and a serial part
/// of kGroup² form factors per group, and nothing in convergence.
///
/// A symmetric solve turns around after every sweep; each direction counts as one.
class GaussSeidelSolver final : public RadiositySolver {
 public:
  GaussSeidelSolver(const FormFactorBlocks& form_factors, const RadiosityProblem& problem,
                    SweepOrder order = SweepOrder::kForward);

 private:
  void begin(bool cold) override;
  SweepReport sweep() override;
  void finish() override;

  void gather_from_outside(std::size_t group_begin, std::size_t group_end);
  double relax_group(std::size_t group_begin, std::size_t group_end);
  double relax_row(std::size_t row);

  const FormFactorBlocks& blocks_;
  SweepOrder order_;
  bool backward_ = false;        ///< direction of the next sweep
  std::vector<float> planes_;    ///< B, in planes
  std::vector<Float3> outside_;  ///< [kGroup] gathered from outside the group
};

}  // namespace rebounce
