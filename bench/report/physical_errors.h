#pragma once

#include "bench/report/contenders.h"

namespace rebounce::bench {

/// How far the pipeline's indirect light H is from the path tracer's under a key light, and what
/// each of its parts adds: relative, area-weighted L2 over all channels.
struct TruthResult {
  reference::RelativeError patch_means;  ///< everything: means over patches
  /// What is left with far more rays for form factors and the dense operator: that light is one
  /// value per patch, and that lamps are looked at at some points of it.
  reference::RelativeError discretisation;
  reference::RelativeError reconstruction;  ///< everything, interpolated over the mesh, at points
  double form_factors = 0;  ///< H with the form factors against H with far more rays
  double compression =
      0;  ///< H by the operator of the default tolerance against H by the dense one
};

/// Measures them on `scene`, from which `contenders` were built. Throws Cancelled if asked to stop.
TruthResult measure_truth(const std::string& scene, const Contenders& contenders,
                          const ReportSettings& settings, const ReportProgress& progress);

/// The furnace: every surface reflects half and emits 1 lx, and openings send in what the surfaces
/// would; B is then 2 lx everywhere if rows of F add up to what they should.
struct FurnaceResult {
  double error_mean = 0;  ///< |B / 2 - 1|, area-weighted
  double error_max = 0;
};

FurnaceResult measure_furnace(const TransferData& data);

}  // namespace rebounce::bench
