#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/exchange/pairs/exchange_results.h"

namespace rebounce {

/// A pair in the upper triangle of the exchange matrix under construction.
struct ExchangeEntry {
  std::uint32_t column;
  float exchange_area;        ///< m²
  float unoccluded_area;      ///< m²: the exchange area with nothing between, the upper limit
  float visibility_variance;  ///< of exchange_area / unoccluded_area

  double variance() const {  ///< of exchange_area, m⁴
    const double u = unoccluded_area;
    return u * u * visibility_variance;
  }
};

using ExchangeRows = std::vector<std::vector<ExchangeEntry>>;

/// The target of a row sum of F and its uncertainty (0: certain). A sum of 0 means that no ray met
/// anything.
struct RowSumTarget {
  double sum;
  double deviation;
};

/// The row sums of F that `rows` amount to; `area` [n] in m².
std::vector<double> row_sums(const ExchangeRows& rows, std::span<const double> area);

/// The largest error of a row sum, over all rows or over those with a certain target.
double largest_row_error(std::span<const double> sum, std::span<const RowSumTarget> target,
                         bool certain);

/// Corrects the exchange areas so that rows add up to their targets; reciprocity holds.
///
/// Minimises sum (S' - S)² / variance + sum over i of (row sum of F' - target)² / deviation² over
/// symmetric S': the least squares of M. E. Larsen and J. R. Howell, "Least-squares smoothing of
/// direct-exchange areas in zonal analysis", 1986, with two differences. The weights are the
/// variances of the entries, so that pairs in penumbrae change and fully visible pairs stay.
/// Targets that are measured (rows that escape in part) pull only as strongly as they are certain.
/// An entry shrinks by at most half of its value, and grows by at most half or, if that is more, to
/// its unoccluded area. An entry that reaches a bound is fixed there, with variance 0, and the
/// others share the rest.
ClosureReport enforce_closure(ExchangeRows& rows, std::span<const double> area,
                              std::span<const RowSumTarget> target);

}  // namespace rebounce
