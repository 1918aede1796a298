#pragma once

#include "rebounce/build_settings.h"

namespace rebounce {

/// Throws Error if a setting is out of range.
void check_form_factor_settings(const FormFactorSettings& settings);

}  // namespace rebounce
