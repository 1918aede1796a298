#pragma once

#include "bench/report/contenders.h"
#include "bench/support/timing.h"

namespace rebounce::bench {

/// What a frame costs beside the solution for the light of the patches, whichever method finds it:
/// every method's own time ends with radiosity.
struct RestOfFrame {
  /// Direct light of four lamps, a point and a spot that moved, a sphere and a rectangle that did
  /// not; initial exitance.
  Timing direct;
  Timing outputs;  ///< light at the vertices of the display mesh
};

/// Times them on settings.solve_threads threads. Throws Cancelled if asked to stop.
RestOfFrame measure_rest_of_frame(const Contenders& contenders, const ReportSettings& settings,
                                  const ReportProgress& progress);

}  // namespace rebounce::bench
