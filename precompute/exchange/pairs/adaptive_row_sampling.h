#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/exchange/pairs/closure.h"

namespace rebounce {

/// Chooses the rows of F that are worth more rays. More rays correct a row whose sum is off because
/// rays missed something. They do not correct a row whose geometry keeps it from adding up (patches
/// of many triangles, shells), and real scenes have many of those. Where many rows are doubtful, a
/// trial first gives more rays to some rows of each kind, by the size of their errors. The rest of
/// a kind follows only if the trial reduced its errors.
class AdaptiveRowSampling {
 public:
  /// `sum` and `target` [n] of the rows; `tolerance` as in is_doubtful_row().
  AdaptiveRowSampling(std::span<const double> sum, std::span<const RowSumTarget> target,
                      double tolerance);

  /// [n] true for the rows of the trial.
  const std::vector<bool>& trial() const { return trial_; }

  /// [n] true for the rows that get more rays after the trial, given the row sums `sum` [n] that
  /// follow it. No row of the trial is among them. Empty if there are none.
  std::vector<bool> rest(std::span<const double> sum) const;

 private:
  /// The errors of each kind are up to twice those of the one before.
  static constexpr std::size_t kKinds = 8;

  std::size_t kind_of(std::size_t row) const;

  std::vector<double> error_;  ///< [n]
  std::span<const RowSumTarget> target_;
  double tolerance_;
  std::vector<std::uint32_t> doubtful_;  ///< row numbers
  std::vector<bool> trial_;              ///< [n]
};

}  // namespace rebounce
