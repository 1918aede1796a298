#pragma once

#include <span>
#include <vector>

#include "precompute/exchange/pairs/closure.h"
#include "precompute/exchange/pairs/escape.h"

namespace rebounce {

/// The targets of the row sums of F, where `ray_count` rays of each patch measured its `escape`
/// [n].
std::vector<RowSumTarget> row_sum_targets(std::span<const Escape> escape, int ray_count);

/// True if the row sum of a patch is off its target by more than `tolerance` and three deviations:
/// its visibility is misjudged.
bool is_doubtful_row(double sum, const RowSumTarget& target, double tolerance);

/// is_doubtful_row() for every row [n].
std::vector<bool> find_doubtful_rows(std::span<const double> sum,
                                     std::span<const RowSumTarget> target, double tolerance);

}  // namespace rebounce
