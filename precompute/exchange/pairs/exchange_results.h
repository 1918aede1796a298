#pragma once

#include <vector>

#include "transfer/data/sky_cells.h"

namespace rebounce {

/// The size of the correction for closure (closure.h).
struct ClosureReport {
  /// Largest |sum over j of F(i,j) - target| before the correction.
  double row_sum_error_before = 0;
  double row_sum_error_after = 0;  ///< the same after it, over rows with a certain target
  double relative_change = 0;      ///< |S' - S| / |S|, Frobenius
};

/// The light of patches that meets no patch.
struct EscapedLight {
  /// [n] fraction of the light of a patch that leaves the scene.
  std::vector<float> sky_visibility;
  /// [n] fraction that meets back faces; with the row sum of F the three add up to 1.
  std::vector<float> absorbed;
  SkyCells sky_cells;  ///< the sky that patches see, by cell
};

struct FormFactorForecast {
  double seconds = 0;  ///< with all OpenMP threads
  double ray_count = 0;
};

}  // namespace rebounce
