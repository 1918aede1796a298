#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/exchange/pairs/closure.h"

namespace rebounce {

/// Which rows are worth more rays. Rows whose sums are off because rays missed something are mended
/// by more of them; rows that geometry keeps from adding up (patches of many triangles, shells) are
/// not, and in real scenes they are many. So where there are many doubtful rows, some of them of
/// each kind - by how far they are off - are looked at first, and the rest of a kind only if these
/// gained by it.
class AdaptiveRowSampling {
 public:
  /// `sum` and `target` [n] of the rows; `tolerance` as in is_doubtful_row().
  AdaptiveRowSampling(std::span<const double> sum, std::span<const RowTarget> target,
                      double tolerance);

  /// [n] the rows to look at first.
  const std::vector<bool>& trial() const { return trial_; }

  /// [n] the rows that are worth it after that, of which none was in the trial, whose rows now have
  /// the sums `sum` [n]. Empty if there are none.
  std::vector<bool> rest(std::span<const double> sum) const;

 private:
  static constexpr std::size_t kKinds = 8;  ///< the errors of each up to twice those of the last

  std::size_t kind_of(std::size_t row) const;

  std::vector<double> error_;  ///< [n]
  std::span<const RowTarget> target_;
  double tolerance_;
  std::vector<std::uint32_t> doubtful_;  ///< rows
  std::vector<bool> trial_;              ///< [n]
};

}  // namespace rebounce
