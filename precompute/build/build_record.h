#pragma once

#include <vector>

#include "precompute/lights/measured_error.h"
#include "rebounce/build_report.h"
#include "rebounce/build_settings.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Writes the errors of an operator. Mean and largest error are those of point lights, which the
/// tolerance refers to; the bound holds for every kind. Leaves the rest of `record` as it is.
void record_errors(const BuildSettings& decided, const std::vector<KindError>& errors,
                   BuildRecord& record);

/// Writes what a file tells of its build: the decided settings, the part of `report`, which is
/// complete, that is the same in every run, and the errors. Leaves the rest of `data` as it is.
void record_build(const BuildSettings& decided, const BuildReport& report,
                  const std::vector<KindError>& errors, TransferData& data);

}  // namespace rebounce
