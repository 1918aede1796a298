#include "precompute/exchange/pairs/adaptive_row_sampling.h"

#include <algorithm>
#include <cmath>

#include "precompute/exchange/pairs/row_sum_targets.h"

namespace rebounce {
namespace {

// Rows of each kind in the trial.
constexpr std::size_t kTrialRows = 16;

// The fraction of its errors that a kind must lose in the trial (lab/005).
constexpr double kWorthwhile = 0.25;

}  // namespace

AdaptiveRowSampling::AdaptiveRowSampling(std::span<const double> sum,
                                         std::span<const RowSumTarget> target, double tolerance)
    : target_(target), tolerance_(tolerance), trial_(sum.size()) {
  error_.reserve(sum.size());
  std::array<std::vector<std::uint32_t>, kKinds> rows;
  for (std::uint32_t i = 0; i < sum.size(); ++i) {
    error_.push_back(std::abs(sum[i] - target[i].sum));
    if (!is_doubtful_row(sum[i], target[i], tolerance)) continue;
    doubtful_.push_back(i);
    rows[kind_of(i)].push_back(i);
  }
  for (const std::vector<std::uint32_t>& kind : rows) {
    const std::size_t count = std::min(kTrialRows, kind.size());
    for (std::size_t k = 0; k < count; ++k) trial_[kind[k * kind.size() / count]] = true;
  }
}

std::vector<bool> AdaptiveRowSampling::rest(std::span<const double> sum) const {
  std::array<double, kKinds> before{}, after{};
  for (const std::uint32_t i : doubtful_) {
    if (!trial_[i]) continue;
    before[kind_of(i)] += error_[i];
    after[kind_of(i)] += std::abs(sum[i] - target_[i].sum);
  }
  std::vector<bool> rest;
  for (const std::uint32_t i : doubtful_) {
    const std::size_t kind = kind_of(i);
    if (trial_[i] || after[kind] > (1 - kWorthwhile) * before[kind]) continue;
    rest.resize(trial_.size());
    rest[i] = true;
  }
  return rest;
}

/// The binary logarithm of the error over the tolerance, cut at the last kind.
std::size_t AdaptiveRowSampling::kind_of(std::size_t row) const {
  const double allowed = tolerance_ + 3 * target_[row].deviation;
  const double doublings = std::log2(std::max(1.0, error_[row] / allowed));
  return std::min(kKinds - 1, static_cast<std::size_t>(doublings));
}

}  // namespace rebounce
