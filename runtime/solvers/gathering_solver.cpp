#include "runtime/solvers/gathering_solver.h"

namespace rebounce {

RadiositySolver::SweepReport GatheringSolver::sweep() {
  const double norm = compute_residual();
  for (std::size_t i = 0; i < radiosity_.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) radiosity_[i][c] += residual_[i][c];
  }
  // The new residual is rho F times the old one, and |F| <= 1 in the area-weighted norm.
  return {.residual = max_reflectance_ * norm};
}

}  // namespace rebounce
