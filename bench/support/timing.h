#pragma once

#include <functional>
#include <span>
#include <vector>

namespace rebounce::bench {

/// Seconds that `work` takes by the steady clock.
double seconds_of(const std::function<void()>& work);

/// What repeated measurements of one thing amount to.
struct Timing {
  double median = 0;   ///< seconds
  double spread = 0;   ///< interquartile range as a part of the median
  double minimum = 0;  ///< seconds; what a machine that others use disturbs least
};

/// Summarises at least one sample, in seconds.
Timing summarise(std::vector<double> samples);

/// Something to be timed beside others.
struct TimedCase {
  std::function<void()> work;
  std::function<void()> prepare = {};  ///< runs untimed before each `work`; may be empty
  /// Runs of a sample although there is a `prepare`, as many as one without would have: for a
  /// `prepare` that is short and leaves the caches to `work`.
  bool repeat_prepared = false;
};

struct InterleavingSettings {
  int rounds = 21;  ///< samples per case. More: steadier medians
  /// A sample is the mean of as many runs in a row as take this long, in seconds, so that short
  /// work finds the caches as its last run left them. Cases with a `prepare` run once, but see
  /// TimedCase::repeat_prepared, whose sample is the median of its runs.
  double sample_seconds = 5e-3;
};

/// Times every case once per round, one after the other, so that whatever slows the machine down
/// for a while slows all of them. A first round is not counted. Returns one timing per case.
std::vector<Timing> time_interleaved(std::span<const TimedCase> cases,
                                     const InterleavingSettings& settings = {});

}  // namespace rebounce::bench
