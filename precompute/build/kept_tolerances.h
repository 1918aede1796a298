#pragma once

#include "rebounce/build_report.h"
#include "rebounce/scene_data.h"

namespace rebounce {

/// Throws Error if the check of a finished build found that its file does not keep what it
/// promises: a mean error of point lights within the tolerance, none of those lights above
/// kLargestOverMean times as much, and, with `has_form_factors`, compressed form factors within
/// their own tolerance. `report` holds their error then.
void check_tolerances(const BuildRecord& record, const BuildReport& report, bool has_form_factors);

}  // namespace rebounce
