#pragma once

#include <functional>

namespace rebounce {

/// Called now and then during long work, on the thread that started it, with the fraction done in
/// [0, 1]. Returning false asks the work to stop: it throws Cancelled. May be empty.
using Progress = std::function<bool(double fraction)>;

}  // namespace rebounce
