#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/exchange/pairs/exchange_results.h"

namespace rebounce {

/// One pair in the upper triangle of the exchange matrix while it is being made.
struct ExchangeEntry {
  std::uint32_t column;
  float exchange_area;        ///< m²
  float unoccluded_area;      ///< m²: what it would be with nothing between; the most it can be
  float visibility_variance;  ///< of exchange_area / unoccluded_area

  double variance() const {  ///< of exchange_area, m⁴
    const double u = unoccluded_area;
    return u * u * visibility_variance;
  }
};

using ExchangeRows = std::vector<std::vector<ExchangeEntry>>;

/// What a row of F should add up to, and how sure that is (0: certain). A sum of 0: no ray saw
/// anything.
struct RowTarget {
  double sum;
  double deviation;
};

/// The row sums of F that `rows` amount to; `area` [n] in m².
std::vector<double> row_sums(const ExchangeRows& rows, std::span<const double> area);

/// The largest error of a row sum, of all rows or of those whose target is certain.
double largest_row_error(std::span<const double> sum, std::span<const RowTarget> target,
                         bool certain);

/// Corrects the exchange areas so that rows add up to their targets, reciprocity untouched.
///
/// Minimises sum (S' - S)² / variance + sum over i of (row sum of F' - target)² / deviation² over
/// symmetric S': the least squares of M. E. Larsen and J. R. Howell, "Least-squares smoothing of
/// direct-exchange areas in zonal analysis", 1986, with two differences. The weights are variances
/// that we know, so that pairs in penumbrae give way and fully visible ones stay; and targets that
/// are themselves measured (rows that escape in part) pull only as hard as they are certain.
/// Entries stay within half of what they were; those that would not are held there, their variance
/// made 0, and the others share out what is left.
ClosureReport enforce_closure(ExchangeRows& rows, std::span<const double> area,
                              std::span<const RowTarget> target);

}  // namespace rebounce
