#pragma once

#include <vector>

#include "precompute/build/build_report.h"
#include "precompute/build/build_settings.h"
#include "precompute/lights/measured_error.h"

namespace rebounce {

/// Writes the record of a build for a file: the decided settings, the part of `report` that is the
/// same in every run, and the errors. Mean and largest error are those of point lights, which the
/// tolerance refers to; the bound holds for every kind. Leaves the rest of `record` as it is.
void record_build(const BuildSettings& decided, const BuildReport& report,
                  const std::vector<KindError>& errors, BuildRecord& record);

}  // namespace rebounce
