#pragma once

#include <array>

#include "precompute/exchange/pairs/form_factors.h"

namespace rebounce::bench {

/// A quality of form factors, and what is asked of a form factor that is known.
struct NamedQuality {
  const char* name;
  FormFactorQuality quality;
  double asked_part, asked_least;  ///< its error at most, relative or absolute; 0: nothing is
};

inline constexpr std::array kQualities = {
    NamedQuality{"low", FormFactorQuality::kLow, 0, 0},
    NamedQuality{"default", FormFactorQuality::kDefault, 5e-3, 5e-5},
    NamedQuality{"high", FormFactorQuality::kHigh, 1e-3, 1e-5}};

}  // namespace rebounce::bench
