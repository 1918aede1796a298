#include "precompute/exchange/pairs/row_sum_targets.h"

#include <cmath>

namespace rebounce {
std::vector<RowSumTarget> row_sum_targets(std::span<const Escape> escape, int ray_count) {
  std::vector<RowSumTarget> target;
  target.reserve(escape.size());
  for (const Escape& e : escape) {
    const double lost = e.sky + e.absorbed, count = ray_count;
    // If no ray is lost, the row counts as closed. A single lost ray does not open it, because the
    // ray may have begun beyond the wall of an edge, by the offset of rays. Otherwise the
    // uncertainty follows from the rule of succession; low-discrepancy rays have about half the
    // error of random ones. If all rays are lost, the patch sees nothing, with certainty.
    const bool unseeing = lost * count > count - 0.5;
    const bool closed = !unseeing && lost * count < 1.5;
    const double p = (lost * count + 1) / (count + 2);
    const double seen = unseeing ? 0 : 1 - lost;
    target.push_back({closed ? 1 : seen, closed ? 0 : 0.5 * std::sqrt(p * (1 - p) / count)});
  }
  return target;
}

bool is_doubtful_row(double sum, const RowSumTarget& target, double tolerance) {
  return std::abs(sum - target.sum) > tolerance + 3 * target.deviation;
}

std::vector<bool> find_doubtful_rows(std::span<const double> sum,
                                     std::span<const RowSumTarget> target, double tolerance) {
  std::vector<bool> doubtful(sum.size());
  for (std::size_t i = 0; i < sum.size(); ++i) {
    doubtful[i] = is_doubtful_row(sum[i], target[i], tolerance);
  }
  return doubtful;
}

}  // namespace rebounce
