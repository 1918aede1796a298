#pragma once

#include <functional>

#include "rebounce/error.h"

namespace rebounce {

/// Called from time to time during long work, on the thread that started it, with the fraction done
/// in [0, 1]. If it returns false, the work stops and throws Cancelled. May be empty.
using Progress = std::function<bool(double fraction)>;

/// Reports `fraction` to `progress`; throws Cancelled if it asks to stop.
inline void report_progress(const Progress& progress, double fraction) {
  if (progress && !progress(fraction)) throw Cancelled();
}

/// The progress of a part of some work: the part runs from `begin` to `end` of `whole`, both in [0,
/// 1]. `whole` must outlive the result.
inline Progress part_of(const Progress& whole, double begin, double end) {
  if (!whole) return {};
  return [&whole, begin, end](double fraction) { return whole(begin + fraction * (end - begin)); };
}

}  // namespace rebounce
