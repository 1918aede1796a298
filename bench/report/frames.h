#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bench/report/accuracy.h"
#include "bench/report/light_paths.h"

namespace rebounce::bench {

/// Frames from a switch until the error is below a threshold; 0: the same frame. Where the next
/// switch comes first, as many as there are in between.
struct Lag {
  double mean = 0;
  int worst = 0;
  int never = 0;  ///< switches before whose next one the error does not fall below
};

/// What a method that has so many microseconds for each frame makes of a light path.
struct FrameRow {
  std::string path;
  std::size_t contestant = 0;
  double budget = 0;  ///< microseconds a frame
  int sweeps = 0;     ///< that fit into it; 0: none, nor the product, and nothing was measured
  double error_mean = 0, error_p95 = 0, error_worst = 0;  ///< reflected_error, over the frames
  std::optional<Lag> lag_percent{},
      lag_permille{};           ///< to errors of 1 and 0.1 %; of paths with switches
  std::vector<float> errors{};  ///< by frame
};

/// Follows each path with every contestant at each of settings.budgets, every frame from the
/// solution of the one before, or in the dark where that is better after a switch; that before the
/// first frame is exact. How many sweeps fit is told by `times` and not by a clock, so that the
/// errors are the same in every run that has the same times. The truth is the dense inverse, which
/// gets `truth_error` for its own. Throws Cancelled if asked to stop.
std::vector<FrameRow> measure_frames(const Contenders& contenders,
                                     const std::vector<Contestant>& contestants,
                                     const std::vector<RunTime>& times, double truth_error,
                                     const ReportSettings& settings,
                                     const ReportProgress& progress);

/// The lag of these errors after these switches.
Lag lag_after(const std::vector<int>& switches, const std::vector<float>& errors, double threshold);

}  // namespace rebounce::bench
