#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>

#include "transfer/file/transfer_data.h"

namespace rebounce::cli {

/// Describes a transfer file of `file_bytes`, under stable keys that scripts rely on.
nlohmann::json info_json(const TransferData& data, std::uint64_t file_bytes);

}  // namespace rebounce::cli
