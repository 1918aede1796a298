#pragma once

#include <vector>

#include "rebounce/build_report.h"
#include "rebounce/scene_data.h"

namespace rebounce {

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
  double entry_count = 0;  ///< pairs of patches that exchange light
};

}  // namespace rebounce
