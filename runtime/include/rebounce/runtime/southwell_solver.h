#pragma once

#include <vector>

#include "rebounce/runtime/radiosity_solver.h"
#include "rebounce/transfer/form_factor_blocks.h"

namespace rebounce {

/// Southwell relaxation, which is progressive shooting: the patch with the largest unshot power
/// (area times residual, channels added up) sends it to all that it sees; of equals the first.
/// (M. F. Cohen, S. E. Chen, J. R. Wallace, D. P. Greenberg, "A progressive refinement approach to
/// fast radiosity image generation", SIGGRAPH 1988; S. J. Gortler, M. F. Cohen, P. Slusallek,
/// "Radiosity and relaxation methods", 1994.)
///
/// A sweep is n shots, which read about as much of F as one gather; the time budget is looked at
/// far more often. Shots depend on each other: it runs on one thread.
class SouthwellSolver final : public RadiositySolver {
 public:
  SouthwellSolver(const FormFactorBlocks& form_factors, const RadiosityProblem& problem);

 private:
  void begin(bool cold) override;
  SweepReport sweep() override;
  void finish() override;

  void shoot_largest();
  double unshot_norm() const;

  const FormFactorBlocks& blocks_;
  std::vector<float> unshot_power_;        ///< planes: area times residual, lm
  std::vector<float> reflectance_planes_;  ///< planes
};

}  // namespace rebounce
