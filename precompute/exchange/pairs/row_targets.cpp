#include "precompute/exchange/pairs/row_targets.h"

#include <cmath>

namespace rebounce {
std::vector<RowTarget> row_targets(std::span<const Escape> escape, int ray_count) {
  std::vector<RowTarget> target;
  target.reserve(escape.size());
  for (const Escape& e : escape) {
    const double lost = e.sky + e.absorbed, count = ray_count;
    // Where no ray at all is lost, the row is taken as closed; nor does a single one open it, as it
    // may have begun beyond the wall of an edge, a ray's offset away. Else the measurement is as
    // sure as the rule of succession says; low-discrepancy rays err about half as much as random
    // ones. Where all are lost, nothing is seen, exactly.
    const bool closed = lost * count < 1.5;
    const bool unseeing = lost * count > count - 0.5;
    const double p = (lost * count + 1) / (count + 2);
    const double seen = unseeing ? 0 : 1 - lost;
    target.push_back({closed ? 1 : seen, closed ? 0 : 0.5 * std::sqrt(p * (1 - p) / count)});
  }
  return target;
}

bool is_doubtful_row(double sum, const RowTarget& target, double tolerance) {
  return std::abs(sum - target.sum) > tolerance + 3 * target.deviation;
}

std::vector<bool> find_doubtful_rows(std::span<const double> sum, std::span<const RowTarget> target,
                                     double tolerance) {
  std::vector<bool> doubtful(sum.size());
  for (std::size_t i = 0; i < sum.size(); ++i) {
    doubtful[i] = is_doubtful_row(sum[i], target[i], tolerance);
  }
  return doubtful;
}

}  // namespace rebounce
