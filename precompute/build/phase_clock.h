#pragma once

#include <chrono>

#include "precompute/base/process_memory.h"
#include "precompute/base/progress.h"
#include "rebounce/build_report.h"
#include "rebounce/error.h"

namespace rebounce {

/// Measures the time of the phases of a build and passes their progress on. What a phase has freed
/// is given back to the system at its end, so that the next one does not need memory beside it.
class PhaseClock {
 public:
  PhaseClock(BuildReport& report, const BuildProgress& progress)
      : report_(report), progress_(progress) {}

  /// Returns the result of `work`, which is given a Progress. Throws Cancelled if asked to stop.
  template <typename Work>
  auto run(const char* phase, const Work& work) {
    const Progress progress = [this, phase](double fraction) {
      return !progress_ || progress_(phase, fraction);
    };
    if (!progress(0)) throw Cancelled();
    const auto begin = std::chrono::steady_clock::now();
    auto result = work(progress);
    return_freed_memory();
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    report_.seconds.emplace_back(phase, seconds.count());
    if (!progress(1)) throw Cancelled();
    return result;
  }

 private:
  BuildReport& report_;
  const BuildProgress& progress_;
};

}  // namespace rebounce
