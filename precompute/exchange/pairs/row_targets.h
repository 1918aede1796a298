#pragma once

#include <span>
#include <vector>

#include "precompute/exchange/pairs/closure.h"
#include "precompute/exchange/pairs/escape.h"

namespace rebounce {

/// What the rows of F should add up to where `ray_count` rays of each patch measured its `escape`
/// [n].
std::vector<RowTarget> row_targets(std::span<const Escape> escape, int ray_count);

/// True if the `sum` of a patch's row is off its target by more than `tolerance` and three
/// deviations: visibility must have been misjudged.
bool is_doubtful_row(double sum, const RowTarget& target, double tolerance);

/// The same of every row [n].
std::vector<bool> find_doubtful_rows(std::span<const double> sum, std::span<const RowTarget> target,
                                     double tolerance);

}  // namespace rebounce
