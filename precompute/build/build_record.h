#pragma once

#include <vector>

#include "precompute/lights/measured_error.h"
#include "rebounce/build_report.h"
#include "rebounce/build_settings.h"

namespace rebounce {

/// Writes the record of a build for a file: the decided settings, the part of `report` that is the
/// same in every run, and the errors. Mean and largest error are those of point lights, which the
/// tolerance refers to; the bound holds for every kind. Leaves the rest of `data` as it is.
void record_build(const BuildSettings& decided, const BuildReport& report,
                  const std::vector<KindError>& errors, TransferData& data);

}  // namespace rebounce
