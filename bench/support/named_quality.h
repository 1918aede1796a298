#pragma once

#include <array>

#include "precompute/exchange/pairs/form_factors.h"

namespace rebounce::bench {

struct NamedQuality {
  const char* name;
  FormFactorQuality quality;
};

inline constexpr std::array kQualities = {NamedQuality{"low", FormFactorQuality::kLow},
                                          NamedQuality{"default", FormFactorQuality::kDefault},
                                          NamedQuality{"high", FormFactorQuality::kHigh}};

}  // namespace rebounce::bench
