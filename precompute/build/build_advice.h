#pragma once

#include <string>
#include <vector>

#include "rebounce/build_report.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// What sticks out in a finished build, a short line each: what it means, and which option of
/// precompute helps. Empty for an ordinary scene.
std::vector<std::string> build_advice(const TransferData& data, const BuildReport& report);

}  // namespace rebounce
