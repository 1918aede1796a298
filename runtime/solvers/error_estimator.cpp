#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "rebounce/error.h"
#include "rebounce/solvers.h"
#include "runtime/solvers/file_form_factors.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/argument_check.h"
#include "transfer/base/light_sum.h"
#include "transfer/base/reflection.h"

namespace rebounce {
namespace {

void check_operator(const TransferOperator* transfer) {
  if (transfer == nullptr) throw Error("error estimate: the transfer data have no operator");
  if (!transfer->roles().all_are_both()) {
    throw Error(
        "error estimate: the operator has receivers or sources, and errors can be estimated only "
        "without; precompute without --receivers and --sources");
  }
}

double largest(std::span<const Float3> reflectance) {
  float most = 0;
  for (const Float3& rho : reflectance) most = std::max(most, std::ranges::max(rho));
  return most;
}

}  // namespace

// With B = M0 + rho H and the residual r = F B - H of an indirect irradiance H, the exact one is
// H + e, where
//   e = (I - F rho)^-1 r = r + Y rho r.
// The stored operator in place of Y gives the correction d = r + Y rho r, and one more gather its
// own residual s = r + F rho d - d. In the symmetric form G = A^1/2 F A^-1/2, where |G| <= 1
// because no row of F sums to more than 1,
//   (I - G rho)^-1 = I + G rho^1/2 (I - rho^1/2 G rho^1/2)^-1 rho^1/2,
// so that |e - d| <= |s| + sqrt(m) / (1 - m) |rho^1/2 s| with m = max(rho), in the norm weighted by
// area.
struct ErrorEstimator::Parts {
  Parts(std::shared_ptr<const TransferData> of, FormFactorSource source) : data(std::move(of)) {
    check_operator(data->transfer.get());
    form_factors = take_form_factors(*data, SolveMethod::kGathering, source);
    const std::size_t n = data->patches.size();
    for (auto* values : {&residual, &light, &correction}) values->resize(n);
    gather_workspace.resize(form_factors->workspace_size());
    transfer_workspace.resize(data->transfer->workspace_size());
    max_reflectance = largest(data->patches.reflectance);
  }

  double norm(std::span<const Float3> values) const {
    return area_norm(values, data->patches.area);
  }

  void gather(std::span<const Float3> in, std::span<Float3> out, const Scheduler& scheduler) {
    form_factors->gather(in, out, gather_workspace, scheduler);
  }

  /// The upper limit of |(I - F rho)^-1 s|. Overwrites `light`.
  double limit_of(std::span<const Float3> s) {
    for (std::size_t i = 0; i < s.size(); ++i) {
      for (int c = 0; c < kChannelCount; ++c) {
        light[i][c] = std::sqrt(data->patches.reflectance[i][c]) * s[i][c];
      }
    }
    return norm(s) + std::sqrt(max_reflectance) / (1 - max_reflectance) * norm(light);
  }

  std::shared_ptr<const TransferData> data;
  std::unique_ptr<const FormFactorOperator> form_factors;
  double max_reflectance = 0;
  std::vector<Float3> residual, light, correction;
  std::vector<float> gather_workspace, transfer_workspace;
};

ErrorEstimator::ErrorEstimator(std::shared_ptr<const TransferData> data, FormFactorSource source) {
  if (!data) throw Error("error estimate: there are no transfer data");
  parts_ = std::make_unique<Parts>(std::move(data), source);
}

ErrorEstimator::~ErrorEstimator() = default;
ErrorEstimator::ErrorEstimator(ErrorEstimator&&) noexcept = default;
ErrorEstimator& ErrorEstimator::operator=(ErrorEstimator&&) noexcept = default;

ErrorEstimate ErrorEstimator::estimate_error(std::span<const Float3> initial_exitance,
                                             std::span<const Float3> indirect_irradiance,
                                             const Scheduler& scheduler) {
  Parts& p = *parts_;
  const std::span<const Float3> reflectance = p.data->patches.reflectance;
  check_size("error estimate: initial exitance", initial_exitance.size(), reflectance.size());
  check_size("error estimate: indirect irradiance", indirect_irradiance.size(), reflectance.size());
  check_light_of_patches("error estimate: initial exitance", initial_exitance);
  if (!std::isfinite(p.norm(indirect_irradiance))) {
    throw Error("error estimate: an indirect irradiance is not finite");
  }
  add_reflected(initial_exitance, reflectance, indirect_irradiance, p.light);
  p.gather(p.light, p.residual, scheduler);
  add_to(p.residual, indirect_irradiance, -1);

  std::ranges::copy(p.residual, p.light.begin());
  reflect(reflectance, p.light);
  p.data->transfer->apply(p.light, p.correction, p.transfer_workspace, scheduler);
  add_to(p.correction, p.residual);

  std::ranges::copy(p.correction, p.light.begin());
  reflect(reflectance, p.light);
  const double error = p.norm(p.correction);
  add_to(p.residual, p.correction, -1);
  add_to(p.correction, indirect_irradiance);
  const double solution = p.norm(p.correction);
  p.gather(p.light, p.correction, scheduler);
  add_to(p.residual, p.correction);
  const double rest = p.limit_of(p.residual);

  if (error == 0 && rest == 0) return {};
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return {.error = solution > 0 ? error / solution : kInfinity,
          .bound = solution > rest ? (error + rest) / (solution - rest) : kInfinity};
}

}  // namespace rebounce
