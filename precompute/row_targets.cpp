#include "row_targets.h"

#include <cmath>

namespace rebounce {
namespace {

// A row whose sum is off its target by more than this (and three deviations) is traced again: it is
// partly covered, and probe rays miss what little of it is seen. Rows of patches of many triangles
// are off by as much as their kernel is coarse, which more rays do not mend.
constexpr double kRowSumTolerance = 0.005, kCoarseRowSumTolerance = 0.005;

}  // namespace

std::vector<RowTarget> row_targets(std::span<const Escape> escape, int ray_count) {
  std::vector<RowTarget> target;
  target.reserve(escape.size());
  for (const Escape& e : escape) {
    const double lost = e.sky + e.absorbed, count = ray_count;
    // Where no ray at all is lost, the row is taken as closed. Else the measurement is as sure as
    // the rule of succession says; low-discrepancy rays err about half as much as random ones.
    const double p = (lost * count + 1) / (count + 2);
    target.push_back({1 - lost, lost > 0 ? 0.5 * std::sqrt(p * (1 - p) / count) : 0.0});
  }
  return target;
}

bool is_doubtful_row(double sum, const RowTarget& target) {
  return std::abs(sum - target.sum) > kRowSumTolerance + 3 * target.deviation;
}

std::vector<bool> find_doubtful_rows(std::span<const double> sum,
                                     std::span<const RowTarget> target) {
  std::vector<bool> doubtful(sum.size());
  for (std::size_t i = 0; i < sum.size(); ++i) {
    doubtful[i] = is_doubtful_row(sum[i], target[i]);
  }
  return doubtful;
}

}  // namespace rebounce
