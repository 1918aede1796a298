#pragma once

#include <string>

#include "rebounce/precompute/build.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce::bench {

/// Loads a transfer file, or builds its data from a scene. Throws Error if it cannot.
TransferData load_or_build(const std::string& input, const BuildSettings& settings);

/// Name of the scene, without its extension.
std::string scene_name(const TransferData& data);

}  // namespace rebounce::bench
