#pragma once

#include "rebounce/build_report.h"
#include "rebounce/scene_data.h"

namespace rebounce {

/// The tolerance with which an operator is worth being made again, because one of the point lights
/// of its check errs by more than kLargestOverMean times the tolerance: 0 if none does, or so much
/// that a finer operator is not what it takes.
double finer_tolerance(const BuildRecord& record);

/// Throws Error if the check of a finished build found that its file does not keep what it
/// promises: a mean error of point lights within the tolerance, none of those lights above
/// kLargestOverMean times as much, and, with `has_form_factors`, compressed form factors within
/// their own tolerance. `report` holds their error then.
void check_tolerances(const BuildRecord& record, const BuildReport& report, bool has_form_factors);

}  // namespace rebounce
