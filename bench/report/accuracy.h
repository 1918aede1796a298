#pragma once

#include <string>
#include <vector>

#include "bench/report/light_cases.h"
#include "bench/report/method.h"
#include "bench/support/timing.h"

namespace rebounce::bench {

/// What a method makes of a change of the light after so many sweeps, and in what time.
struct AccuracyRow {
  std::size_t contestant = 0;  ///< in the list of contestants
  std::string change;          ///< as LightCase names it
  int sweeps = 0;              ///< 0: a product
  bool cold = false;           ///< an iteration that starts in the dark
  double error = 0;            ///< reflected_error against the reference, mean over the lamps
  double error_max = 0;        ///< its largest
  double iteration_error = 0;  ///< the mean against the solution on the method's own form of F
  Timing time{};               ///< caches as the method's own last run left them
  Timing cold_time{};          ///< after something else has used the caches
};

/// Errors and times of every contestant after every change: for iterations after each
/// sweep until they have converged. All times are interleaved; those of iterations are of
/// a line through the times of a few numbers of sweeps. Throws Cancelled if asked to stop.
std::vector<AccuracyRow> measure_accuracy(const Contenders& contenders,
                                          const std::vector<Contestant>& contestants,
                                          const ReportSettings& settings,
                                          const ReportProgress& progress);

/// What a run of a method costs when it starts from the frame before: start + sweeps x sweep,
/// microseconds.
struct RunTime {
  double start = 0, sweep = 0;

  /// Sweeps that fit into a frame; a product, whose sweep is 0, counts as one. 0: none.
  int sweeps_within(double microseconds) const;
};

/// For each contestant, from the measured rows of warm starts.
std::vector<RunTime> run_times(const std::vector<AccuracyRow>& rows, std::size_t contestant_count);

}  // namespace rebounce::bench
