#include "rebounce/runtime/southwell_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace rebounce {
namespace {

constexpr std::size_t kShotsPerLookAtTheClock = 64;

}  // namespace

SouthwellSolver::SouthwellSolver(const FormFactorBlocks& form_factors,
                                 const RadiosityProblem& problem)
    : RadiositySolver(form_factors, problem),
      blocks_(form_factors),
      unshot_power_(kChannelCount * form_factors.plane_size()),
      reflectance_planes_(kChannelCount * form_factors.plane_size()) {}

void SouthwellSolver::begin(bool cold) {
  if (cold) {  // nothing is shot yet: no gather is needed to know what is unshot
    std::ranges::copy(initial_exitance_, residual_.begin());
    std::ranges::fill(radiosity_, Float3{0, 0, 0});
  } else {
    compute_residual();
  }
  blocks_.to_planes(reflectance_, reflectance_planes_);
  blocks_.to_planes(residual_, unshot_power_);
  const std::size_t stride = blocks_.plane_size();
  for (int c = 0; c < kChannelCount; ++c) {
    for (std::size_t i = 0; i < patch_count(); ++i) unshot_power_[c * stride + i] *= area_[i];
  }
}

RadiositySolver::SweepReport SouthwellSolver::sweep() {
  for (std::size_t shot = 0; shot < patch_count(); ++shot) {
    if (shot % kShotsPerLookAtTheClock == 0 && out_of_time()) break;
    shoot_largest();
  }
  return {.residual = unshot_norm()};
}

void SouthwellSolver::shoot_largest() {
  const std::size_t stride = blocks_.plane_size(), i = blocks_.largest(unshot_power_);
  Float3 power;
  for (int c = 0; c < kChannelCount; ++c) {
    power[c] = std::exchange(unshot_power_[c * stride + i], 0.0F);
    radiosity_[i][c] += power[c] / area_[i];
  }
  blocks_.shoot(i, power, reflectance_planes_, unshot_power_);
}

void SouthwellSolver::finish() {
  // What is unshot still leaves its patch: light that was received is shown at once.
  const std::size_t stride = blocks_.plane_size();
  for (std::size_t i = 0; i < patch_count(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      radiosity_[i][c] += unshot_power_[c * stride + i] / area_[i];
    }
  }
}

double SouthwellSolver::unshot_norm() const {
  const std::size_t stride = blocks_.plane_size();
  double sum = 0;
  for (std::size_t i = 0; i < patch_count(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      const double power = unshot_power_[c * stride + i];
      sum += power * power / area_[i];
    }
  }
  return std::sqrt(sum);
}

}  // namespace rebounce
