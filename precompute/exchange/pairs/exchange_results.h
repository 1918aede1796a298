#pragma once

#include <vector>

#include "transfer/data/sky_cells.h"

namespace rebounce {

/// How large the correction for closure was (closure.h).
struct ClosureReport {
  double row_sum_error_before = 0;  ///< largest |sum over j of F(i,j) - target| before
  double row_sum_error_after = 0;   ///< the same after, over rows whose target is exact
  double relative_change = 0;       ///< |S' - S| / |S|, Frobenius
};

/// Where the light of patches goes that no patch gets.
struct EscapedLight {
  std::vector<float> sky_visibility;  ///< [n] fraction of a patch's light that leaves the scene
  std::vector<float> absorbed;        ///< [n] fraction that meets back faces; with the row sum of F
                                      ///< the three add up to 1
  SkyCells sky_cells;                 ///< by which of its cells patches see the sky
};

struct FormFactorForecast {
  double seconds = 0;  ///< with the threads that there are
  double ray_count = 0;
};

}  // namespace rebounce
