#pragma once

#include <functional>

#include "transfer/base/error.h"

namespace rebounce {

/// Called now and then during long work, on the thread that started it, with the fraction done in
/// [0, 1]. Returning false asks the work to stop: it throws Cancelled. May be empty.
using Progress = std::function<bool(double fraction)>;

/// Tells `progress` that `fraction` is done; throws Cancelled if it asks to stop.
inline void report_progress(const Progress& progress, double fraction) {
  if (progress && !progress(fraction)) throw Cancelled();
}

/// The progress of a part of some work that runs from `begin` to `end` of it. `whole` must outlive
/// it.
inline Progress part_of(const Progress& whole, double begin, double end) {
  if (!whole) return {};
  return [&whole, begin, end](double fraction) { return whole(begin + fraction * (end - begin)); };
}

}  // namespace rebounce
